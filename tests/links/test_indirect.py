"""Indirect links against a slow reading of their definition: many small histories at once.

Unlike the histories of tests/model they are rows of the store: nothing has to be read, and nothing
is lost.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path
from random import Random

import duckdb
import pytest
from support.annotated_history import History, Publication, Run, reference
from support.golden import insert

HISTORIES = 400
INPUTS, OUTPUTS, THREADS = 3, 2, 3


def make_history(number: int, moments: Iterator[int]) -> History:
    """A node whose callbacks run on several threads, and publish; its ids are its own."""
    random = Random(number)
    history = History()
    inputs = [number * INPUTS + each for each in range(1, INPUTS + 1)]
    outputs = [number * OUTPUTS + each for each in range(1, OUTPUTS + 1)]
    threads = [number * THREADS + each for each in range(1, random.randint(1, THREADS) + 1)]
    nests = random.choice((1, 1, 2, 3))
    nestable = random.choice((inputs, inputs[-1:]))
    for _ in range(random.randint(1, 2)):
        annotation = (
            random.choice(("periodic_async", "partial_sync")),
            frozenset(random.sample(inputs, random.randint(2, INPUTS))),
            frozenset(random.sample(outputs, random.randint(1, OUTPUTS))),
        )
        if annotation not in history.annotations:
            history.annotations.append(annotation)
    stacks: dict[int, list[Run]] = {thread: [] for thread in threads}
    for _ in range(random.randint(10, 60)):
        thread = random.choice(threads)
        stack, action = stacks[thread], random.random()
        if action < 0.35 and len(stack) < nests:
            subscription = random.choice((*(nestable if stack else inputs), None))
            run = Run(subscription, thread, next(moments), tuple(stack))
            history.runs.append(run)
            stack.append(run)
        elif action < 0.6 and stack:
            stack.pop().end.append(next(moments))
        elif action > 0.8:
            inner = stack[-1] if stack else None
            history.publications.append(
                Publication(random.choice(outputs), thread, next(moments), inner)
            )
    for stack in stacks.values():
        while stack:
            stack.pop().end.append(next(moments))
    return history


def rows(histories: list[History]) -> dict[str, list[dict[str, int | str | None]]]:
    """The histories as rows of the store."""
    tables: dict[str, list[dict[str, int | str | None]]] = {
        name: []
        for name in (
            "annotation",
            "annotation_input",
            "annotation_output",
            "callback",
            "callback_instance",
            "publication",
        )
    }
    timer = HISTORIES * INPUTS + 1
    tables["callback"] = [
        {"callback_id": each, "kind": "subscription", "subscription_id": each}
        for each in range(1, timer)
    ]
    tables["callback"].append({"callback_id": timer, "kind": "timer", "subscription_id": None})
    for history in histories:
        for kind, inputs, outputs in history.annotations:
            number = len(tables["annotation"]) + 1
            tables["annotation"].append({"annotation_id": number, "kind": kind, "source": "trace"})
            tables["annotation_input"] += [
                {"annotation_id": number, "subscription_id": each} for each in sorted(inputs)
            ]
            tables["annotation_output"] += [
                {"annotation_id": number, "publisher_id": each} for each in sorted(outputs)
            ]
        # A run is known by its start, a publication by its moment.
        tables["callback_instance"] += [
            {
                "callback_instance_id": run.start,
                "callback_id": run.subscription or timer,
                "thread_id": run.thread,
                "start_ns": run.start,
                "end_ns": run.ended,
                "start_event_id": run.start,
                "end_event_id": run.ended,
                "effective_end_event_id": run.ended,
                "depth": 1 + len(run.outer),
                "parent_id": run.outer[-1].start if run.outer else None,
            }
            for run in history.runs
        ]
        tables["publication"] += [
            {
                "publication_id": b.at,
                "publisher_id": b.publisher,
                "thread_id": b.thread,
                "start_ns": b.at,
                "end_ns": b.at,
                "start_event_id": b.at,
                "end_event_id": b.at,
                "callback_event_id": max(
                    (
                        moment
                        for run in history.runs
                        for moment in (run.start, run.ended)
                        if run.thread == b.thread and moment < b.at
                    ),
                    default=None,
                ),
            }
            for b in history.publications
        ]
    return tables


@pytest.mark.thorough
def test_links_are_those_of_the_definition(fresh_database: Path) -> None:
    moments = count(1)
    histories = [make_history(number, moments) for number in range(HISTORIES)]
    expected = sorted(link for history in histories for link in reference(history))
    with duckdb.connect(str(fresh_database)) as con:
        insert(con, "run", ["run_id", "name"], [["1", "run"]])
        for table, content in rows(histories).items():
            insert(
                con,
                table,
                list(content[0]),
                [[None if x is None else str(x) for x in row.values()] for row in content],
            )
        found = con.execute(
            "SELECT callback_instance_id, publication_id, kind, candidate_count "
            "FROM derive.link_causal_indirect(1) ORDER BY ALL"
        ).fetchall()
    assert found == expected
    counts = {(kind, min(count, 4)) for _, _, kind, count in expected}
    assert counts == {(k, n) for k in ("periodic_async", "partial_sync") for n in (1, 2, 3, 4)}
