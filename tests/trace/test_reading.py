"""Values, types and counts of events, on traces whose every byte is known."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import uuid4

import pyarrow as pa
import pytest
from support.ctf_writer import CONTEXTS, Event, Packet, TraceContent, write_trace

from msgflow.errors import UsageError
from msgflow.trace import PACKET, Progress, TraceSet
from msgflow.trace.columns import COMMON_SCHEMA

Rows = dict[str, list[dict[str, Any]]]
Open = Callable[..., TraceSet]
Read = Callable[..., Rows]

EPOCH = 1_700_000_000_000_000_000
TYPES = {
    "pointer": "u64",
    "signed": "i64",
    "small": "i32",
    "byte": "u8",
    "ratio": "f64",
    "single": "f32",
    "name": "str",
    "label": "text[8]",
    "gid": "u8[4]",
    "subs": "u64[]",
}
VALUES = (2**64 - 1, -(2**63), -7, 255, 0.5, 0.25, "Bücher".encode(), b"ab", [1, 2, 3, 255], [9])


def one_event(types: dict[str, str], *payloads: tuple[Any, ...], **more: Any) -> TraceContent:
    events = [Event(10 + i, "ros2:x", payload) for i, payload in enumerate(payloads)]
    return TraceContent(events={"ros2:x": types}, streams={0: [Packet(events)]}, **more)


def test_values_of_every_type(tmp_path: Path, read_rows: Read) -> None:
    trace = write_trace(tmp_path / "trace", one_event(TYPES, VALUES))
    (row,) = read_rows(trace)["ros2:x"]
    assert row == {
        "event_id": 0,
        "ts_ns": EPOCH + 10,
        "trace_index": 0,
        "cpu_id": 0,
        "vpid": 100,
        "vtid": 101,
        "procname": "main",
        "pid_ns": None,
        "pointer": 2**64 - 1,
        "signed": -(2**63),
        "small": -7,
        "byte": 255,
        "ratio": 0.5,
        "single": 0.25,
        "name": "Bücher",
        "label": "ab",
        "gid": [1, 2, 3, 255],
        "subs_length": 1,
        "subs": [9],
    }


def test_types_follow_the_declaration(tmp_path: Path, open_traces: Open) -> None:
    trace = write_trace(tmp_path / "trace", one_event(TYPES, VALUES))
    with open_traces(trace) as traces:
        batch = next(b.batch for b in traces.batches() if b.name == "ros2:x")
    assert batch.schema.names[: len(COMMON_SCHEMA)] == COMMON_SCHEMA.names
    assert batch.schema.types[: len(COMMON_SCHEMA)] == COMMON_SCHEMA.types
    assert batch.schema.types[len(COMMON_SCHEMA) :] == [
        pa.uint64(),
        pa.int64(),
        pa.int32(),
        pa.uint8(),
        pa.float64(),
        pa.float32(),
        pa.string(),
        pa.string(),
        pa.list_(pa.uint8()),
        pa.uint32(),
        pa.list_(pa.uint64()),
    ]


def test_empty_strings_after_others(tmp_path: Path, read_rows: Read) -> None:
    payloads = [(b"first",), (b"",), (b"third",), (b"",)]
    trace = write_trace(tmp_path / "trace", one_event({"text": "str"}, *payloads))
    assert [row["text"] for row in read_rows(trace)["ros2:x"]] == ["first", "", "third", ""]


def test_text_that_is_not_utf8(tmp_path: Path, read_rows: Read) -> None:
    trace = write_trace(tmp_path / "trace", one_event({"text": "str"}, (b"a\xffb",), (b"fine",)))
    assert [row["text"] for row in read_rows(trace)["ros2:x"]] == ["a\ufffdb", "fine"]


def test_thread_name_that_is_not_utf8(tmp_path: Path, read_rows: Read) -> None:
    content = TraceContent(
        events={"ros2:x": {}},
        streams={0: [Packet([Event(1, "ros2:x", (), (1, 2, b"r\xe9sum\xe9"))])]},
    )
    (row,) = read_rows(write_trace(tmp_path / "trace", content))["ros2:x"]
    assert row["procname"] == "r\ufffdsum\ufffd"


def test_empty_sequences(tmp_path: Path, read_rows: Read) -> None:
    trace = write_trace(tmp_path / "trace", one_event({"subs": "u64[]"}, ([],), ([1, 2],), ([],)))
    assert [row["subs"] for row in read_rows(trace)["ros2:x"]] == [[], [1, 2], []]


class TestWanted:
    schema = pa.schema(
        [
            ("label", pa.string()),
            ("pointer", pa.uint64()),
            ("absent", pa.int64()),
            ("gid", pa.list_(pa.uint8())),
        ]
    )

    def test_columns_in_their_order_and_type(self, tmp_path: Path, open_traces: Open) -> None:
        trace = write_trace(tmp_path / "trace", one_event(TYPES, VALUES))
        with open_traces(trace) as traces:
            batches = [b for b in traces.batches({"ros2:x": self.schema}) if b.name != PACKET]
        assert [batch.name for batch in batches] == ["ros2:x"]
        assert batches[0].batch.schema == pa.schema([*COMMON_SCHEMA, *self.schema])
        row = batches[0].batch.to_pylist()[0]
        assert [row[name] for name in self.schema.names] == ["ab", 2**64 - 1, None, [1, 2, 3, 255]]

    def test_alias(self, tmp_path: Path, read_rows: Read) -> None:
        handle = pa.field("rmw_handle", pa.uint64(), metadata={"aliases": "other,handle"})
        for name, types in {"new": {"rmw_handle": "u64"}, "old": {"handle": "u64"}}.items():
            trace = write_trace(tmp_path / name, one_event(types, (5,)))
            (row,) = read_rows(trace, wanted={"ros2:x": pa.schema([handle])})["ros2:x"]
            assert row["rmw_handle"] == 5

    def test_name_before_alias(self, tmp_path: Path, read_rows: Read) -> None:
        handle = pa.field("rmw_handle", pa.uint64(), metadata={"aliases": "handle"})
        types = {"handle": "u64", "rmw_handle": "u64"}
        trace = write_trace(tmp_path / "trace", one_event(types, (1, 2)))
        (row,) = read_rows(trace, wanted={"ros2:x": pa.schema([handle])})["ros2:x"]
        assert row["rmw_handle"] == 2

    def test_integers_that_do_not_fit_keep_their_bits(
        self, tmp_path: Path, read_rows: Read
    ) -> None:
        types = {"a": "i64", "b": "u64", "c": "u64[]"}
        trace = write_trace(tmp_path / "trace", one_event(types, (-1, 2**63 + 1, [2**64 - 1, 3])))
        wanted = pa.schema([("a", pa.uint64()), ("b", pa.int64()), ("c", pa.list_(pa.int64()))])
        (row,) = read_rows(trace, wanted={"ros2:x": wanted})["ros2:x"]
        assert (row["a"], row["b"], row["c"]) == (2**64 - 1, 1 - 2**63, [-1, 3])

    def test_field_of_another_kind_is_null(self, tmp_path: Path, read_rows: Read) -> None:
        trace = write_trace(tmp_path / "trace", one_event({"a": "str", "b": "u64"}, (b"x", 1)))
        wanted = pa.schema([("a", pa.int64()), ("b", pa.string())])
        (row,) = read_rows(trace, wanted={"ros2:x": wanted})["ros2:x"]
        assert (row["a"], row["b"]) == (None, None)

    def test_event_ids_count_what_is_not_wanted(self, tmp_path: Path, open_traces: Open) -> None:
        names = ["ros2:x", "sched_switch", "sched_switch", "ros2:x"]
        content = TraceContent(
            events={"ros2:x": {}, "sched_switch": {}},
            streams={0: [Packet([Event(i, name) for i, name in enumerate(names)])]},
        )
        with open_traces(write_trace(tmp_path / "trace", content)) as traces:
            batches = list(traces.batches({"ros2:x": pa.schema([])}))
            assert traces.event_counts == {(0, "ros2:x"): 2, (0, "sched_switch"): 2}
        assert [b.name for b in batches] == ["ros2:x", PACKET]
        assert batches[0].batch.column("event_id").to_pylist() == [0, 3]


class TestContext:
    def read(self, tmp_path: Path, read_rows: Read, **content: Any) -> dict[str, Any]:
        trace = write_trace(tmp_path / "trace", TraceContent(**content))
        (row,) = read_rows(trace)["ros2:x"]
        return row

    def test_by_name_in_any_order(self, tmp_path: Path, read_rows: Read) -> None:
        contexts = {name: CONTEXTS[name] for name in ("procname", "vtid", "vpid")}
        contexts["pid_ns"] = "u32"
        row = self.read(
            tmp_path,
            read_rows,
            events={"ros2:x": {}},
            contexts=contexts,
            streams={0: [Packet([Event(1, "ros2:x", (), (b"talker", 8, 7, 4026531836))])]},
        )
        assert (row["vpid"], row["vtid"], row["procname"]) == (7, 8, "talker")
        assert row["pid_ns"] == 4026531836

    def test_of_the_event_class(self, tmp_path: Path, read_rows: Read) -> None:
        row = self.read(
            tmp_path,
            read_rows,
            events={"ros2:x": {"vtid": "u64"}},
            contexts={"procname": "text[17]"},
            specific={"ros2:x": {"vtid": "i32", "vpid": "i32"}},
            streams={0: [Packet([Event(1, "ros2:x", (99,), (b"talker",), (8, 7))])]},
        )
        assert (row["vpid"], row["procname"]) == (7, "talker")

    def test_absent(self, tmp_path: Path, read_rows: Read) -> None:
        row = self.read(
            tmp_path,
            read_rows,
            events={"ros2:x": {}},
            contexts={},
            streams={0: [Packet([Event(1, "ros2:x", (), ())])]},
        )
        assert (row["vpid"], row["vtid"], row["procname"], row["pid_ns"]) == (-1, -1, None, None)

    def test_cpu_is_that_of_the_packet(self, tmp_path: Path, read_rows: Read) -> None:
        packets = [Packet([Event(1, "ros2:x")], cpu=3), Packet([Event(2, "ros2:x")], cpu=5)]
        content = TraceContent(events={"ros2:x": {}}, streams={0: packets})
        rows = read_rows(write_trace(tmp_path / "trace", content))["ros2:x"]
        assert [row["cpu_id"] for row in rows] == [3, 5]


class TestInfo:
    def test_what_the_trace_declares(self, tmp_path: Path, open_traces: Open) -> None:
        content = TraceContent(
            events={"ros2:b": {}, "ros2:a": {}},
            streams={0: [Packet([Event(5, "ros2:b")], begin=3, end=9)], 1: [Packet(begin=2)]},
        )
        trace = write_trace(tmp_path / "trace", content)
        with open_traces(trace) as traces:
            (info,) = traces.traces
        assert info.index == 0
        assert info.path == trace.resolve()
        assert info.uuid == "11111111-2222-3333-4444-555555555555"
        assert info.clock_uuid == "99999999-8888-7777-6666-555555555555"
        assert (info.domain, info.hostname, info.tracer) == ("ust", "robot", "lttng-ust 2.13")
        assert (info.clock_name, info.clock_offset_ns) == ("monotonic", EPOCH)
        assert (info.begin_ns, info.end_ns) == (EPOCH + 2, EPOCH + 9)
        assert info.has_process_context
        assert info.event_names == ("ros2:a", "ros2:b")

    @pytest.mark.parametrize("missing", ["vpid", "vtid"])
    def test_process_context_takes_both(
        self, tmp_path: Path, open_traces: Open, missing: str
    ) -> None:
        contexts = {name: kind for name, kind in CONTEXTS.items() if name != missing}
        packet = Packet([Event(1, "ros2:x", (), (1, b"main"))])
        content = TraceContent(events={"ros2:x": {}}, streams={0: [packet]}, contexts=contexts)
        with open_traces(write_trace(tmp_path / "trace", content)) as traces:
            assert not traces.traces[0].has_process_context

    def test_tracer_that_says_nothing(self, tmp_path: Path, open_traces: Open) -> None:
        content = TraceContent(
            events={"x": {}}, streams={0: [Packet([Event(1, "x")])]}, environment={}
        )
        with open_traces(write_trace(tmp_path / "trace", content)) as traces:
            (info,) = traces.traces
        assert (info.domain, info.hostname, info.tracer) == (None, None, None)

    def test_trace_without_streams_keeps_its_place(self, tmp_path: Path, open_traces: Open) -> None:
        write_trace(tmp_path / "a", TraceContent(events={"ros2:x": {}}, streams={}))
        write_trace(tmp_path / "b", one_event({}, ()))
        with open_traces(tmp_path) as traces:
            assert [info.event_names for info in traces.traces] == [(), ("ros2:x",)]
            assert traces.traces[0].begin_ns is None
            rows = [b.batch.to_pylist() for b in traces.batches() if b.name == "ros2:x"]
        assert [row["trace_index"] for row in rows[0]] == [1]


class TestSeveralTraces:
    def test_kernel_beside_user_space(self, tmp_path: Path, open_traces: Open) -> None:
        write_trace(tmp_path / "ust", one_event({"a": "u64"}, (1,), (2,)))
        kernel = TraceContent(
            events={"sched_switch": {"prev_tid": "i32"}},
            streams={0: [Packet([Event(10, "sched_switch", (5,), (3,))])]},
            contexts={"tid": "i32"},
            environment={"domain": "kernel", "tracer_name": "lttng-modules"},
            trace_uuid=uuid4(),
        )
        write_trace(tmp_path / "kernel", kernel)
        with open_traces(tmp_path) as traces:
            assert [info.domain for info in traces.traces] == ["kernel", "ust"]
            assert [info.has_process_context for info in traces.traces] == [False, True]
            batches = list(traces.batches({"ros2:x": pa.schema([("a", pa.uint64())])}))
            assert traces.event_counts == {(0, "sched_switch"): 1, (1, "ros2:x"): 2}
        assert batches[0].batch.column("event_id").to_pylist() == [1, 2]

    def test_one_event_of_different_layout(self, tmp_path: Path, read_rows: Read) -> None:
        first = TraceContent(
            events={"ros2:x": {"message": "u64"}},
            streams={0: [Packet([Event(t, "ros2:x", (t,)) for t in (1, 4)])]},
        )
        second = TraceContent(
            events={"ros2:x": {"handle": "u64", "message": "u32"}},
            streams={0: [Packet([Event(t, "ros2:x", (7, t), (8, b"other", 9)) for t in (2, 3)])]},
            contexts={"vtid": "i32", "procname": "text[17]", "vpid": "i32"},
            trace_uuid=uuid4(),
        )
        write_trace(tmp_path / "a", first)
        write_trace(tmp_path / "b", second)
        rows = read_rows(tmp_path)["ros2:x"]
        assert [row["event_id"] for row in rows] == [0, 1, 2, 3]
        assert [row["trace_index"] for row in rows] == [0, 1, 1, 0]
        assert [row["message"] for row in rows] == [1, 2, 3, 4]
        assert [row["handle"] for row in rows] == [None, 7, 7, None]
        assert [row["procname"] for row in rows] == ["main", "other", "other", "main"]
        assert [row["vpid"] for row in rows] == [100, 9, 9, 100]


class TestIteration:
    def content(self, tmp_path: Path, count: int = 30_000, packets: int = 1) -> Path:
        events = [Event(i, "ros2:x", (i,)) for i in range(count)]
        size = count // packets
        parts = [Packet(events[begin : begin + size]) for begin in range(0, count, size)]
        content = TraceContent(events={"ros2:x": {"n": "u64"}}, streams={0: parts})
        return write_trace(tmp_path / "trace", content)

    def test_batches_are_bounded(self, tmp_path: Path, open_traces: Open) -> None:
        with open_traces(self.content(tmp_path, 2500)) as traces:
            batches = [b.batch for b in traces.batches(batch_rows=1000) if b.name == "ros2:x"]
        assert [batch.num_rows for batch in batches] == [1000, 1000, 500]
        numbers = [n for batch in batches for n in batch.column("n").to_pylist()]
        assert numbers == list(range(2500))

    def test_progress(self, tmp_path: Path, open_traces: Open) -> None:
        reports: list[Progress] = []
        with open_traces(self.content(tmp_path, packets=1000)) as traces:
            list(traces.batches({}, progress=reports.append, batch_rows=1000))
        assert len(reports) >= 3
        assert reports[-1] == Progress(30_000, 1.0, EPOCH + 29_999)
        assert [r.events for r in reports] == sorted(r.events for r in reports)
        for report in reports:
            assert report.fraction == pytest.approx(report.events / 30_000, abs=0.02)

    def test_twice(self, tmp_path: Path, open_traces: Open) -> None:
        with open_traces(self.content(tmp_path, 100)) as traces:
            first = [batch.batch for batch in traces.batches()]
            assert [batch.batch for batch in traces.batches()] == first
            assert traces.event_counts == {(0, "ros2:x"): 100}

    def test_not_at_the_same_time(self, tmp_path: Path, open_traces: Open) -> None:
        with open_traces(self.content(tmp_path, 100)) as traces:
            iterator = traces.batches()
            with pytest.raises(UsageError, match="being read already"):
                traces.batches()
            assert next(iterator).name == "ros2:x"

    def test_again_after_breaking_off(self, tmp_path: Path, open_traces: Open) -> None:
        with open_traces(self.content(tmp_path, 100)) as traces:
            for _ in traces.batches(batch_rows=10):
                break
            assert sum(b.batch.num_rows for b in traces.batches() if b.name == "ros2:x") == 100

    def test_closing_ends_it(self, tmp_path: Path, open_traces: Open) -> None:
        traces = open_traces(self.content(tmp_path, 100))
        iterator = traces.batches(batch_rows=10)
        next(iterator)
        traces.close()
        traces.close()
        assert list(iterator) == []
        with pytest.raises(UsageError, match="closed"):
            traces.batches()
