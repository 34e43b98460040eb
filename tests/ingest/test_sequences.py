"""Threads and predecessors, against a look at one event after the other."""

from __future__ import annotations

import itertools
from typing import Any

import pyarrow as pa
from hypothesis import given, settings
from hypothesis import strategies as st

from msgflow.ingest.catalogue import Origin, load
from msgflow.ingest.sequences import Sequences
from msgflow.trace.columns import COMMON_SCHEMA

NAMES = (
    "ros2:rcl_init",
    "ros2:rcl_publish",
    "ros2:callback_start",
    "ros2:callback_end",
    "ros2:rclcpp_executor_execute",
    "ros2:rclcpp_executor_wait_for_work",
    "ros2:rclcpp_ring_buffer_enqueue",
)
HOSTS = [0, 1, 0]

Event = dict[str, Any]

events = st.builds(
    dict,
    name=st.sampled_from(NAMES),
    trace_index=st.integers(0, len(HOSTS) - 1),
    pid_ns=st.sampled_from([None, 0, 7]),
    vpid=st.sampled_from([-1, 100, 2**31 - 1]),
    vtid=st.sampled_from([-1, 100, 101]),
    procname=st.sampled_from([None, "talker", "dds"]),
    cpu_id=st.sampled_from([0, 0, 1]),
    gap=st.sampled_from([1, 2, 3, 1_001]),
)


def rounds_of(rounds: list[list[Event]]) -> list[list[Event]]:
    """Number the events; between them are some that nobody wanted."""
    number = 0
    for events_of_round in rounds:
        for event in events_of_round:
            number += event.pop("gap")
            event |= {"event_id": number, "ts_ns": number * 10}
    return rounds


def place(
    sequences: Sequences, of_round: list[Event]
) -> tuple[list[Event], dict[str, list[Event]]]:
    """Give a round to `sequences`, a batch per name: return the events in order, and all tables."""
    batches = []
    for name in NAMES:
        rows = [{k: v for k, v in event.items() if k != "name"} for event in of_round]
        chosen = [row for row, event in zip(rows, of_round, strict=True) if event["name"] == name]
        # Two batches of one name, as a reader delivers where a round is long.
        for part in (chosen[: len(chosen) // 2], chosen[len(chosen) // 2 :]):
            if part:
                schema = pa.schema([*COMMON_SCHEMA, *load().tracepoints[name].arrow_schema()])
                tracepoint = load().tracepoints[name]
                batches.append((tracepoint, pa.RecordBatch.from_pylist(part, schema)))
    placed: dict[str, list[Event]] = {}
    for table, batch in sequences.place(batches):
        placed.setdefault(table, []).extend(batch.to_pylist())
    tables = {load().tracepoints[name].table: name for name in NAMES}
    found = [
        {"name": tables[table]} | row
        for table, rows in placed.items()
        if table in tables
        for row in rows
    ]
    return sorted(found, key=lambda row: row["event_id"]), placed


@settings(deadline=None)
@given(st.lists(st.lists(events, max_size=12), max_size=4))
def test_predecessors_are_the_latest_of_their_sequence(rounds: list[list[Event]]) -> None:
    sequences = Sequences(load(), HOSTS)
    tracepoints = load().tracepoints
    latest: dict[tuple[Any, str], Event] = {}
    threads: dict[int, Any] = {}
    names: list[tuple[Any, ...]] = []
    expected_names: dict[int, list[Event]] = {}
    for of_round in rounds_of(rounds):
        if not of_round:
            continue
        found, placed = place(sequences, of_round)
        for row in placed.get("thread", ()):
            assert row["thread_index"] not in threads
            threads[row["thread_index"]] = (
                HOSTS[row["trace_index"]],
                row["pid_ns"],
                row["vpid"],
                row["vtid"],
            )
        names += [tuple(row.values()) for row in placed["thread_name"]]
        for event, row in zip(of_round, found, strict=True):
            key = (HOSTS[event["trace_index"]], event["pid_ns"], event["vpid"], event["vtid"])
            assert threads[row["thread_index"]] == key
            expected_names.setdefault(row["thread_index"], []).append(event)
            tracepoint = tracepoints[event["name"]]
            for before in tracepoint.predecessors:
                previous = latest.get((key, before.sequence))
                assert row[before.column] == _value(previous, before.origin)
            for sequence in tracepoint.sequences:
                latest[key, sequence] = event
    assert len(set(threads.values())) == len(threads)
    for thread, of_thread in expected_names.items():
        stretches = sorted(name[2:4] + name[1:2] for name in names if name[0] == thread)
        covered = [
            (event["event_id"], event["procname"])
            in {(number, name) for first, last, name in stretches for number in (first, last)}
            or any(
                first < event["event_id"] < last and name == event["procname"]
                for first, last, name in stretches
            )
            for event in of_thread
        ]
        assert all(covered)
        assert all(a[1] < b[0] for a, b in itertools.pairwise(stretches))


@settings(deadline=None)
@given(st.lists(events, min_size=1, max_size=20))
def test_two_changes_of_the_cpu_in_no_time(of_round: list[Event]) -> None:
    """Of a thread that is one of several processes, in one round."""
    rounds_of([of_round])
    found, placed = place(Sequences(load(), HOSTS), of_round)
    of_threads: dict[int, list[Event]] = {}
    expected = []
    for event, row in zip(of_round, found, strict=True):
        of_thread = of_threads.setdefault(row["thread_index"], [])
        before = [each for each in of_thread if each["cpu_id"] == event["cpu_id"]]
        is_change = bool(of_thread) and of_thread[-1]["cpu_id"] != event["cpu_id"]
        if is_change and before and event["ts_ns"] - before[-1]["ts_ns"] < 10_000:
            expected.append((row["thread_index"], event["event_id"]))
        of_thread.append(event)
    rows = [tuple(row.values()) for row in placed.get("cpu_return", ())]
    assert sorted(rows, key=lambda row: row[1]) == expected


def _value(event: Event | None, origin: Origin) -> Any:
    if event is None:
        return None
    if origin == "label":
        return load().tracepoints[event["name"]].label
    return event[origin]
