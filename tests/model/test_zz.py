"""Indirect links against a slow reading of their definition, on small random histories.

The history is one process with threads on CPUs of their own: runs of callbacks of subscriptions
and timers, nested at random, that publish, and at most one loss on one CPU.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st
from ros_system import RosSystem
from staged_events import Analysis, Thread

SUBSCRIPTIONS = (0x11, 0x12, 0x13)
PUBLISHERS = (0x21, 0x22)
TIMER = 0xD0


@dataclass(frozen=True, eq=False)
class Run:
    """A run of a callback; times stand for the order of events, which are all apart."""

    subscription: int | None
    thread: int
    start: int
    outer: tuple[Run, ...]
    end: list[int] = field(default_factory=list)

    @property
    def ended(self) -> int:
        return self.end[0]


@dataclass(frozen=True)
class Publication:
    """A publish() call, and the run that made it."""

    publisher: int
    thread: int
    at: int
    run: Run | None


@dataclass
class History:
    """What happened, and the system that recorded it."""

    system: RosSystem = field(default_factory=RosSystem)
    runs: list[Run] = field(default_factory=list)
    publications: list[Publication] = field(default_factory=list)
    annotations: list[tuple[str, frozenset[int], frozenset[int]]] = field(default_factory=list)
    # (thread, last event before)
    loss: tuple[int, int] | None = None
    # last event of each thread
    heard: dict[int, int] = field(default_factory=dict)


def make_history(seed: int) -> History:
    random = Random(seed)
    history = History()
    system = history.system
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
            history.loss = (n, system._now)
            system.lose(cpu=n)
    for n, stack in enumerate(stacks):
        while stack:
            end(n)
    return history


Link = tuple[int, int, str, int]


def reference(history: History) -> list[Link]:
    """Return (start of the run, publication, kind, candidates) of every indirect link."""
    return sorted(
        link
        for kind, inputs, outputs in history.annotations
        for link in _links(history, kind, inputs, outputs)
    )


def _links(
    history: History, kind: str, inputs: frozenset[int], outputs: frozenset[int]
) -> list[Link]:
    published = [b for b in history.publications if b.publisher in outputs]
    firings = [b for b in published if b.run is not None and b.run.subscription in inputs]
    firing_runs = [b.run for b in firings]
    links = []
    for b in published if kind == "periodic_async" else firings:
        cut = b.at if b.run is None else b.run.start
        first = min((f.at for f in firings if f.run is b.run), default=b.at)
        emptied = max((f.at for f in firings if f.run is not b.run and f.at < first), default=0)
        for subscription in inputs:
            if b.run is not None and b.run.subscription == subscription:
                continue
            runs = [run for run in history.runs if run.subscription == subscription]
            there = [
                run
                for run in runs
                if run.ended <= cut or (b.run in run.outer and run.ended <= b.at)
            ]
            if not there:
                continue
            latest = max(there, key=lambda run: run.ended)
            if kind == "partial_sync" and (latest in firing_runs or latest.ended <= emptied):
                continue
            if _is_broken(history, latest.thread, latest.start, b.at) or _is_broken(
                history, b.thread, latest.start, b.at
            ):
                continue
            under_way = sum(run.start < cut < run.ended for run in runs)
            links.append((latest.start, b.at, kind, 1 + under_way))
    return links


def _is_broken(history: History, thread: int, since: int, until: int) -> bool:
    """Tell whether events of the thread may be missing, as it was heard of again."""
    if history.loss is None or history.loss[0] != thread:
        return False
    return since <= history.loss[1] < until and history.heard[thread] > history.loss[1]


INDIRECT = (
    "SELECT i.start_ns, b.start_ns, l.kind, l.candidate_count FROM link_causal AS l "
    "JOIN callback_instance AS i USING (callback_instance_id) "
    "JOIN publication AS b USING (publication_id) WHERE l.annotation_id IS NOT NULL ORDER BY ALL"
)


@settings(max_examples=600, deadline=None, derandomize=False)
@given(seed=st.integers(0, 100_000))
def test_links_are_those_of_the_definition(analysis: Analysis, seed: int) -> None:
    history = make_history(seed)
    assert analysis.build(history.system).rows(INDIRECT) == reference(history)


def test_histories_are_worth_it(analysis: Analysis) -> None:
    """They have both kinds of links, several candidates, nested runs and losses."""
    kinds, most, nested, losses = set(), 0, 0, 0
    for seed in range(40):
        history = make_history(seed)
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
