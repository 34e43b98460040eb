from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace
from msgflow.events.formats import EventFormat
from msgflow.events.listing import write_events
from msgflow.events.selection import Selection

Listing = Callable[..., str]
Listed = Callable[..., list[dict[str, Any]]]

BEGIN_NS = 1_700_000_000_000_000_000
TYPES = {"count": "u64", "ratio": "f64", "label": "str", "bytes": "u8[]", "level": "i32"}


def content(**changes: Any) -> TraceContent:
    streams = {
        0: [
            Packet(
                [
                    Event(1, "app:start", (2**64 - 1, 0.5, b'say "hi"', [], -1)),
                    Event(30, "app:stop"),
                ]
            )
        ],
        1: [
            Packet(
                [
                    Event(20, "app:start", (7, float("nan"), b"", [1, 255], 4), (100, 102, b"")),
                    Event(30, "app:stop"),
                ],
                cpu=3,
            )
        ],
    }
    return TraceContent(
        **({"events": {"app:start": TYPES, "app:stop": {}}, "streams": streams} | changes)
    )


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    return write_trace(tmp_path / "trace", content())


def test_text(listing: Listing, trace: Path) -> None:
    assert listing(trace).splitlines() == [
        "2023-11-14T22:13:20.000000001Z robot main/100/101 [0] app:start"
        ' count=18446744073709551615 ratio=0.5 label="say \\"hi\\"" bytes_length=0 bytes=[]'
        " level=-1",
        "2023-11-14T22:13:20.000000020Z robot -/100/102 [3] app:start"
        ' count=7 ratio=nan label="" bytes_length=2 bytes=[1, 255] level=4',
        "2023-11-14T22:13:20.000000030Z robot main/100/101 [0] app:stop",
        "2023-11-14T22:13:20.000000030Z robot main/100/101 [3] app:stop",
    ]


def test_addresses_are_hexadecimal(listing: Listing, tmp_path: Path) -> None:
    trace = write_trace(
        tmp_path / "trace",
        TraceContent(
            events={"app:x": {"handle": "x64", "handles": "x64[2]", "number": "u64"}},
            streams={0: [Packet([Event(1, "app:x", (255, [2**64 - 1, 0], 255))])]},
        ),
    )
    line = "handle=0xff handles=[0xffffffffffffffff, 0x0] number=255\n"
    assert listing(trace).endswith(line)
    fields = json.loads(listing(trace, form="jsonl"))["fields"]
    assert fields == {"handle": 255, "handles": [2**64 - 1, 0], "number": 255}


def test_a_terminal_obeys_no_trace(listing: Listing, listed: Listed, tmp_path: Path) -> None:
    hostile = "\x1b]0;x\x07\x9b2J\u202e\u2028"
    trace = write_trace(
        tmp_path / "trace",
        TraceContent(
            events={"app:x": {"text": "str"}},
            streams={0: [Packet([Event(1, "app:x", (hostile.encode(),), (1, 2, b"a\x1bb"))])]},
        ),
    )
    text = listing(trace)
    assert text.count("\n") == 1
    assert text.removesuffix("\n").isprintable()
    (event,) = listed(trace)
    assert (event["fields"]["text"], event["procname"]) == (hostile, "a\x1bb")


def test_without_context_and_host(listing: Listing, listed: Listed, tmp_path: Path) -> None:
    packets = [Packet([Event(1, "sched_switch", (5,), ())])]
    trace = write_trace(
        tmp_path / "trace",
        TraceContent(
            events={"sched_switch": {"next_tid": "i32"}},
            streams={0: packets},
            contexts={},
            environment={},
        ),
    )
    assert listing(trace) == "2023-11-14T22:13:20.000000001Z - -/-/- [0] sched_switch next_tid=5\n"
    (event,) = listed(trace)
    absent = ("hostname", "vpid", "vtid", "procname", "pid_ns")
    assert [event[name] for name in absent] == [None] * 5


def test_json_is_exact(listing: Listing, listed: Listed, trace: Path) -> None:
    events = listed(trace)
    assert events[0] == {
        "event_id": 0,
        "ts_ns": BEGIN_NS + 1,
        "trace_index": 0,
        "hostname": "robot",
        "name": "app:start",
        "cpu_id": 0,
        "vpid": 100,
        "vtid": 101,
        "procname": "main",
        "pid_ns": None,
        "fields": {
            "count": 2**64 - 1,
            "ratio": 0.5,
            "label": 'say "hi"',
            "bytes_length": 0,
            "bytes": [],
            "level": -1,
        },
    }
    # JSON has no NaN.
    assert events[1]["fields"]["ratio"] is None
    assert [event["event_id"] for event in events] == [0, 1, 2, 3]
    assert events[2]["fields"] == {}
    assert json.loads(listing(trace, form="json")) == events


def test_tables_hold_what_json_holds(listing: Listing, listed: Listed, trace: Path) -> None:
    events = listed(trace)
    rows = list(csv.DictReader(io.StringIO(listing(trace, form="csv"))))
    assert [{**row, "fields": json.loads(row["fields"])} for row in rows] == [
        {
            name: value if name == "fields" else "" if value is None else str(value)
            for name, value in event.items()
        }
        for event in events
    ]
    stream = io.BytesIO()
    with msgflow.trace.open([trace]) as traces:
        assert write_events(Selection(traces), EventFormat.PARQUET, stream) == 4
    table = pq.read_table(stream).to_pylist()
    assert [{**row, "fields": json.loads(row["fields"])} for row in table] == events


def test_no_event_is_still_valid_output(listing: Listing, trace: Path) -> None:
    options = {"start": "1h"}
    assert listing(trace, **options) == listing(trace, form="jsonl", **options) == ""
    assert json.loads(listing(trace, form="json", **options)) == []
    header = listing(trace, form="csv", **options)
    assert header.splitlines()[0].endswith('"pid_ns","fields"')
    assert len(header.splitlines()) == 1


def test_rounds_join_without_a_seam(
    listing: Listing, trace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    forms = ("text", "json", "jsonl", "csv")
    whole = [listing(trace, form=form) for form in forms]
    monkeypatch.setattr("msgflow.events.selection.BATCH_ROWS", 1)
    assert [listing(trace, form=form) for form in forms] == whole


def test_fields_called_like_columns_or_with_quotes(listed: Listed, tmp_path: Path) -> None:
    types = {"ts_ns": "i32", "name": "str", "NAME": "str", "event_order": "i32"}
    trace = write_trace(
        tmp_path / "trace",
        TraceContent(
            events={"it's:x": types},
            streams={0: [Packet([Event(1, "it's:x", (5, b"a", b"b", 6))])]},
        ),
    )
    (event,) = listed(trace)
    assert (event["ts_ns"], event["name"]) == (BEGIN_NS + 1, "it's:x")
    assert event["fields"] == {"ts_ns": 5, "name": "a", "NAME": "b", "event_order": 6}
