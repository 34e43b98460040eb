"""Indirect links against a slow reading of their definition, on small random histories.

The history is one process with threads on CPUs of their own: runs of callbacks of subscriptions
and timers, nested at random, that publish, and at most one loss on one CPU.
"""

from __future__ import annotations

from random import Random

import pytest
from support.analysis import Analysis
from support.annotated_history import History, Publication, Run, reference
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import few

SUBSCRIPTIONS = (0x11, 0x12, 0x13)
PUBLISHERS = (0x21, 0x22)
TIMER = 0xD0


def make_history(seed: int) -> tuple[RosSystem, History]:
    random = Random(seed)
    history, system = History(), RosSystem()
    threads = [Thread(100, 100 + n, cpu=n) for n in range(random.randint(1, 3))]
    system.context(threads[0])
    system.node(threads[0], 0x1, "node")
    for handle in SUBSCRIPTIONS:
        system.subscription(threads[0], handle, f"/in{handle}", callback=handle + 0xB0)
    for handle in PUBLISHERS:
        system.publisher(threads[0], handle, f"/out{handle}")
    system.timer(threads[0], 0x31, TIMER)
    for _ in range(random.randint(1, 3)):
        annotation = (
            random.choice(("periodic_async", "partial_sync")),
            frozenset(random.sample(SUBSCRIPTIONS, random.randint(1, 3))),
            frozenset(random.sample(PUBLISHERS, random.randint(1, 2))),
        )
        system.annotate(threads[0], annotation[0], sorted(annotation[1]), sorted(annotation[2]))
        if annotation not in history.annotations:
            history.annotations.append(annotation)
    stacks: list[list[Run]] = [[] for _ in threads]
    stamps = iter(range(1_000_000, 2_000_000))

    def end(thread: int) -> None:
        run = stacks[thread].pop()
        callback = TIMER if run.subscription is None else run.subscription + 0xB0
        run.end.append(system.end(threads[thread], callback))
        history.heard[thread] = run.ended

    for _ in range(random.randint(5, 40)):
        n = random.randrange(len(threads))
        stack, thread, action = stacks[n], threads[n], random.random()
        if action < 0.35 and len(stack) < 3:
            subscription = random.choice((*SUBSCRIPTIONS, None))
            if any(run.subscription == subscription for run in stack):
                continue
            if subscription is not None:
                system.take(thread, subscription, next(stamps))
            callback = TIMER if subscription is None else subscription + 0xB0
            run = Run(subscription, n, system.start(thread, callback), tuple(stack))
            history.heard[n] = run.start
            history.runs.append(run)
            stack.append(run)
        elif action < 0.6 and stack:
            end(n)
        elif action < 0.95:
            publisher = random.choice(PUBLISHERS)
            at = system.publish(thread, publisher, next(stamps))
            inner = stack[-1] if stack else None
            history.publications.append(Publication(publisher, n, at, inner))
            history.heard[n] = at
        elif history.loss is None and not stack and n in history.heard:
            history.loss = (n, system.now)
            system.lose(cpu=n)
    for n, stack in enumerate(stacks):
        while stack:
            end(n)
    return system, history


INDIRECT = (
    "SELECT i.start_ns, b.start_ns, l.kind, l.candidate_count FROM link_causal AS l "
    "JOIN callback_instance AS i USING (callback_instance_id) "
    "JOIN publication AS b USING (publication_id) WHERE l.annotation_id IS NOT NULL ORDER BY ALL"
)


# The last of the few: only there a run ends between the cut of a publication and its reading.
@pytest.mark.thorough
@pytest.mark.parametrize("seed", few(range(30), 18))
def test_links_are_those_of_the_definition(analysis: Analysis, seed: int) -> None:
    system, history = make_history(seed)
    assert analysis.build(system).rows(INDIRECT) == reference(history)


def test_histories_are_worth_it(analysis: Analysis) -> None:
    """They have both kinds of links, several candidates, nested runs and losses."""
    kinds, most, nested, losses = set(), 0, 0, 0
    for seed in range(40):
        _, history = make_history(seed)
        links = reference(history)
        kinds |= {kind for _, _, kind, _ in links}
        most = max([most, *(count for _, _, _, count in links)])
        inner = {run.start for run in history.runs if run.outer}
        nested += sum(start in inner for start, _, _, _ in links)
        losses += history.loss is not None
    assert kinds == {"periodic_async", "partial_sync"}
    assert most > 1
    assert nested
    assert losses
