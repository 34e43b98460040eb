"""What ran on CPUs, in rounds of any size, against a loop over one event after the other."""

from __future__ import annotations

from random import Random
from typing import Any

import pyarrow as pa
import pytest

from msgflow.ingest.catalogue import load
from msgflow.ingest.cpus import INTERRUPT, Cpus
from msgflow.trace.columns import COMMON_SCHEMA

Row = dict[str, Any]
NAMES = [
    "sched_switch",
    "sched_waking",
    "irq_handler_entry",
    "irq_handler_exit",
    "irq_softirq_entry",
    "irq_softirq_exit",
    "timer_hrtimer_expire_entry",
    "timer_hrtimer_expire_exit",
]


def recorded(random: Random, count: int) -> list[tuple[str, Row]]:
    """Events of three CPUs of two traces; now and then what leaves a CPU is not what had it."""
    events = []
    had = {}
    for number in range(count):
        name = random.choice(NAMES)
        trace, cpu = where = random.choice([(0, 0), (0, 1), (1, 0)])
        row = {"event_id": number, "ts_ns": 10 * number, "trace_index": trace, "cpu_id": cpu}
        if name == "sched_switch":
            tid = random.randrange(4)
            before = had.get(where, 1) if random.random() < 0.9 else 9
            row |= {"prev_tid": before, "next_tid": tid, "next_comm": f"thread {tid}"}
            had[where] = tid
        events.append((name, row | {"vpid": -1, "vtid": -1}))
    return events


def expected(events: list[tuple[str, Row]]) -> dict[int, tuple[Any, ...]]:
    """Return what each switch and waking should say, and which exits end an interrupt."""
    found: dict[int, tuple[Any, ...]] = {}
    switch: dict[Any, tuple[int, int, int, int]] = {}
    opened: dict[Any, dict[str, tuple[int, int]]] = {}
    for name, row in events:
        where = row["trace_index"], row["cpu_id"]
        last, of_cpu = switch.get(where), opened.setdefault(where, {})
        role, kind = load().tracepoints[name].role, load().tracepoints[name].interrupt or ""
        if role == "switch":
            since = last[1] if last and last[2] == row["prev_tid"] else None
            number = last[3] + 1 if last else 0
            found[row["event_id"]] = (since, number)
            switch[where] = (row["event_id"], row["ts_ns"], row["next_tid"], number)
            of_cpu.clear()
        elif role == "waking":
            innermost = max(of_cpu, key=lambda one: of_cpu[one][0]) if of_cpu else None
            found[row["event_id"]] = (last[0] if last else None, innermost)
        elif role == "begin":
            of_cpu[kind] = (row["event_id"], row["ts_ns"])
        elif kind in of_cpu:
            _, since = of_cpu.pop(kind)
            if last and last[2] > 0:
                found[row["event_id"]] = (kind, since, row["ts_ns"], last[2])
    return found


@pytest.mark.parametrize("size", [1, 7, 50, 400])
def test_rounds_of_any_size_say_the_same(size: int) -> None:
    events = recorded(Random(size), 400)
    cpus = Cpus(load())
    found: dict[int, tuple[Any, ...]] = {}
    ends = {row["ts_ns"]: row["event_id"] for _, row in events}
    for begin in range(0, len(events), size):
        of_round = events[begin : begin + size]
        batches = []
        for name in NAMES:
            rows = [row for other, row in of_round if other == name]
            tracepoint = load().tracepoints[name]
            schema = pa.schema([*COMMON_SCHEMA, *tracepoint.arrow_schema()])
            if rows:
                batches.append((tracepoint, pa.RecordBatch.from_pylist(rows, schema=schema)))
        for table, placed in cpus.place(batches):
            for row in placed.to_pylist():
                if table == INTERRUPT:
                    values = row["kind"], row["start_ns"], row["end_ns"], row["tid"]
                    found[ends[row["end_ns"]]] = values
                elif table == "sched_switch":
                    found[row["event_id"]] = (row["run_start_ns"], row["switch_number"])
                else:
                    found[row["event_id"]] = (row["switch_event_id"], row["interrupt"])
    assert found == expected(events)
    assert {len(values) for values in found.values()} == {2, 4}
