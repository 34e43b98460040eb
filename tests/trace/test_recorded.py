"""Recorded traces, against known counts and against a plain loop over bt2's own objects."""

from __future__ import annotations

import shutil
import tracemalloc
from collections import Counter
from collections.abc import Callable, Iterator
from operator import itemgetter
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from support.thorough import few, thorough

import msgflow.trace
from msgflow.ingest import catalogue
from msgflow.trace import PACKET, TraceSet

Open = Callable[..., TraceSet]

REAL = "tracecompass-ros2"
OUR_OWN = {"event_id", "trace_index"}
RECORDED = [
    REAL,
    "sync_1_1",
    "sync_1_1_humble",
    "sync_1_1_jazzy",
    "pingpong",
    "periodic_async_jazzy24",
    "partial_sync",
    "services",
]
COUNTS_OF_REAL = {
    "ros2:rclcpp_executor_get_next_ready": 24189,
    "ros2:rclcpp_executor_wait_for_work": 12096,
    "ros2:rclcpp_executor_execute": 6065,
    "ros2:callback_start": 6065,
    "ros2:callback_end": 6065,
    "dds:write": 6153,
    "dds:write_pre": 6095,
    "ros2:rmw_publish": 6095,
    "ros2:rcl_publish": 6061,
    "ros2:rclcpp_publish": 4032,
    "ros2:rmw_take": 4094,
    "dds:read": 4094,
    "ros2:rcl_take": 4034,
    "ros2:rclcpp_take": 4034,
    "dds:create_writer": 29,
    "dds:create_reader": 26,
    "ros2:rmw_publisher_init": 11,
    "ros2:rmw_subscription_init": 8,
    "ros2:rcl_publisher_init": 8,
    "ros2:rcl_subscription_init": 5,
    "ros2:rclcpp_subscription_init": 5,
    "ros2:rclcpp_subscription_callback_added": 5,
    "ros2:rcl_service_init": 18,
    "ros2:rclcpp_service_callback_added": 18,
    "ros2:rclcpp_callback_register": 24,
    "ros2:rcl_timer_init": 1,
    "ros2:rclcpp_timer_callback_added": 1,
    "ros2:rclcpp_timer_link_node": 1,
    "ros2:rcl_init": 3,
    "ros2:rcl_node_init": 3,
}


def tables_of(traces: TraceSet, wanted: dict[str, pa.Schema] | None = None) -> dict[str, pa.Table]:
    batches: dict[str, list[pa.RecordBatch]] = {}
    for batch in traces.batches(wanted):
        batches.setdefault(batch.name, []).append(batch.batch)
    return {
        name: pa.Table.from_batches(parts).unify_dictionaries() for name, parts in batches.items()
    }


def sorted_by(table: pa.Table, *columns: str) -> pa.Table:
    return table.sort_by([(column, "ascending") for column in columns])


def test_counts_of_the_real_trace(shared_traces: Path, open_traces: Open) -> None:
    with open_traces(shared_traces / REAL) as traces:
        tables = tables_of(traces, catalogue.load().arrow_schemas())
        assert traces.event_counts == {(0, name): n for name, n in COUNTS_OF_REAL.items()}
        (info,) = traces.traces
    assert sum(COUNTS_OF_REAL.values()) == 99_338
    assert {name: len(table) for name, table in tables.items() if name != PACKET} == COUNTS_OF_REAL
    assert (info.domain, info.hostname, info.tracer) == ("ust", "chrisnux", "lttng-ust 2.11")
    assert info.clock_uuid == "507ad184-257b-4164-b479-27ac6cfeb1fe"
    assert len(info.event_names) == 35


@pytest.mark.parametrize("name", few(RECORDED, "periodic_async_jazzy24"))
def test_order_and_packets(shared_traces: Path, open_traces: Open, name: str) -> None:
    with open_traces(shared_traces / name) as traces:
        tables = tables_of(traces)
        counts = dict(traces.event_counts)
        infos = traces.traces
    packets = sorted_by(tables.pop(PACKET), "trace_index", "stream_index", "position")
    common = ["event_id", "ts_ns", "trace_index"]
    for table in tables.values():
        ids = table.column("event_id").to_pylist()
        assert ids == sorted(ids)
    events = sorted_by(
        pa.concat_tables([table.select(common) for table in tables.values()]), *common[:1]
    )
    assert events.column("event_id").to_pylist() == list(range(sum(counts.values())))
    times = list(zip(*(events.column(name).to_pylist() for name in common[1:]), strict=True))
    assert times == sorted(times)

    assert sum(packets.column("event_count").to_pylist()) == len(events)
    previous: dict[str, Any] = {}
    for row in packets.to_pylist():
        stream = (row["trace_index"], row["stream_index"])
        if previous and stream == (previous["trace_index"], previous["stream_index"]):
            assert row["position"] == previous["position"] + 1
            assert row["begin_ns"] >= previous["end_ns"]
        else:
            assert row["position"] == 0
        assert row["begin_ns"] <= (row["last_event_ns"] or row["begin_ns"]) <= row["end_ns"]
        info = infos[row["trace_index"]]
        assert info.begin_ns is not None
        assert info.end_ns is not None
        assert info.begin_ns <= row["begin_ns"] <= row["end_ns"] <= info.end_ns
        previous = row


def test_wanted_events_keep_their_ids(shared_traces: Path, open_traces: Open) -> None:
    names = ("ros2:rmw_take", "ros2:callback_start")
    schemas = catalogue.load().arrow_schemas()
    with open_traces(shared_traces / REAL) as traces:
        whole = tables_of(traces, schemas)
        part = tables_of(traces, {name: schemas[name] for name in names})
    assert set(part) == {*names, PACKET}
    for name in (*names, PACKET):
        assert part[name].equals(whole[name])


def test_a_copy_changes_nothing(shared_traces: Path, open_traces: Open, tmp_path: Path) -> None:
    original = shared_traces / "services"
    shutil.copytree(original, tmp_path / "copy")
    schemas = catalogue.load().arrow_schemas()
    with open_traces(original) as traces:
        alone = tables_of(traces, schemas)
    # The copy's path sorts before or after; either way each packet comes from one place.
    with open_traces(original, tmp_path / "copy") as traces:
        both = tables_of(traces, schemas)
        assert traces.duplicate_packet_count == len(alone[PACKET])
        assert len(traces.traces) == 4
    for name, table in alone.items():
        kept = [column for column in table.column_names if column != "trace_index"]
        assert both[name].select(kept).equals(table.select(kept))
        assert len(set(both[name].column("trace_index").to_pylist())) <= 2


def test_hosts_stay_apart(shared_traces: Path, open_traces: Open) -> None:
    with open_traces(shared_traces / "pingpong") as traces:
        assert [info.hostname for info in traces.traces] == ["robot-a", "robot-b"]
        assert len({info.clock_uuid for info in traces.traces}) == 2
        per_trace = Counter[int]()
        for batch in traces.batches():
            if batch.name != PACKET:
                for found in batch.batch.column("trace_index").value_counts().to_pylist():
                    per_trace[found["values"]] += found["counts"]
        by_count = Counter[int]()
        for (trace_index, _), count in traces.event_counts.items():
            by_count[trace_index] += count
    assert per_trace == by_count
    assert set(per_trace) == {0, 1}


@pytest.mark.parametrize(
    ("folder", "names"),
    [
        thorough("services", None),
        thorough("partial_sync", {"ros2:message_link_partial_sync", "dds:create_writer"}),
        ("periodic_async_jazzy24", {"ros2:message_link_periodic_async", "ros2:rmw_publisher_init"}),
    ],
)
def test_values_are_those_of_a_plain_loop(
    shared_traces: Path,
    open_traces: Open,
    bt2_bindings: Any,
    folder: str,
    names: set[str] | None,
) -> None:
    with open_traces(shared_traces / folder) as traces:
        tables = tables_of(traces)
        paths = [info.path for info in traces.traces]
    rows = [
        {"name": name, "pid_ns": None, **row}
        for name, table in tables.items()
        if name != PACKET and (names is None or name in names)
        for row in table.to_pylist()
    ]
    rows.sort(key=itemgetter("event_id"))
    assert rows
    ours = [
        [
            {column: value for column, value in row.items() if column not in OUR_OWN}
            for row in rows
            if row["trace_index"] == trace_index
        ]
        for trace_index in range(len(paths))
    ]
    assert ours == [
        sorted(plain_loop(bt2_bindings, path, names), key=time_and_cpu) for path in paths
    ]


def time_and_cpu(row: dict[str, Any]) -> tuple[int, int]:
    return row["ts_ns"], row["cpu_id"]


def plain_loop(bt2: Any, path: Path, names: set[str] | None) -> Iterator[dict[str, Any]]:
    """Read a trace as bt2's documentation says."""
    for message in bt2.TraceCollectionMessageIterator(str(path)):
        if type(message) is not bt2._EventMessageConst:
            continue
        event = message.event
        if names is not None and event.name not in names:
            continue
        yield {
            "name": event.name,
            "ts_ns": message.default_clock_snapshot.ns_from_origin,
            "cpu_id": int(event.packet.context_field["cpu_id"]),
            "vpid": int(event["vpid"]),
            "vtid": int(event["vtid"]),
            "procname": plain(event["procname"]),
            "pid_ns": None,
            **{str(name): plain(event.payload_field[name]) for name in event.payload_field},
        }


def plain(field: Any) -> Any:
    if hasattr(field, "append") or type(field).__name__.startswith("_String"):
        return str(field) if len(field) else ""
    if hasattr(field, "__len__"):
        return [plain(element) for element in field]
    return int(field)


@pytest.mark.thorough
def test_memory_is_bounded_by_the_batch(shared_traces: Path, bt2_bindings: Any) -> None:
    def peak(batch_rows: int) -> int:
        with msgflow.trace.open([shared_traces / "services"], reader="bt2") as traces:
            tracemalloc.start()
            try:
                for batch in traces.batches(batch_rows=batch_rows):
                    assert batch.batch.num_rows <= batch_rows
                return tracemalloc.get_traced_memory()[1]
            finally:
                tracemalloc.stop()

    few, many = peak(500), peak(50_000)
    assert few < 1_500_000
    assert many > 3 * few
