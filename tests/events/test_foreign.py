"""Traces of other tracers: structures of any shape, and events without times."""

from __future__ import annotations

import csv
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace
from msgflow.errors import TraceError, UsageError
from msgflow.events.formats import EventFormat
from msgflow.events.selection import Selection
from msgflow.events.tables import write_event_tables
from msgflow.ingest import ingest

Listing = Callable[..., str]
Listed = Callable[..., list[dict[str, Any]]]

BYTE = "integer { size = 8; align = 8; }"
TYPES = f"typealias {BYTE} := uint8_t;"
CLOCK = "clock { name = c; freq = 1000000000; };"
TIME = "integer { size = 64; align = 8; map = clock.c.value; } timestamp;"


def write(directory: Path, metadata: str, **files: bytes) -> Path:
    directory.mkdir()
    (directory / "metadata").write_text(
        f"/* CTF 1.8 */ trace {{ major = 1; minor = 8; byte_order = le; }}; {TYPES} {metadata}"
    )
    for name, content in files.items():
        (directory / name).write_bytes(content)
    return directory


def one_event(directory: Path, fields: str, payload: bytes) -> Path:
    """A trace of one event at time 5."""
    metadata = f"""{CLOCK} stream {{ event.header := struct {{ {TIME} }}; }};
        event {{ name = "odd"; fields := struct {{ {fields} }}; }};"""
    return write(directory, metadata, stream=struct.pack("<Q", 5) + payload)


ODD = f"""
    integer {{ size = 1; align = 1; }} _bits[16];
    {BYTE} _none[0];
    struct {{ }} _empty;
    struct {{ }} _empties[2];
    enum : {BYTE} {{ left, right }} _side;
    variant <_side> {{ struct {{ }} left; struct {{ {BYTE} _a; }} right; }} _chosen;
    {BYTE} _last;
"""


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    return one_event(tmp_path / "odd", ODD, bytes([0b0101, 0x80, 0, 9]))


class TestShapes:
    def test_text(self, listing: Listing, odd: Path) -> None:
        bits = "1, 0, 1" + ", 0" * 12 + ", 1"
        assert listing(odd) == (
            f"1970-01-01T00:00:00.000000005Z - -/-/- [-] odd bits=[{bits}] none=[] empty={{}} "
            'empties=[{}, {}] side="left" chosen={left={}} last=9\n'
        )

    def test_json(self, listed: Listed, odd: Path) -> None:
        (event,) = listed(odd)
        assert event["fields"]["empty"] == {}
        assert event["fields"]["empties"] == [{}, {}]
        assert event["fields"]["side"] == "left"
        assert event["fields"]["last"] == 9

    @pytest.mark.parametrize("form", [EventFormat.PARQUET, EventFormat.CSV])
    def test_tables(self, odd: Path, tmp_path: Path, form: EventFormat) -> None:
        with msgflow.trace.open([odd]) as traces:
            write_event_tables(Selection(traces), form, tmp_path / "out")
        path = tmp_path / "out" / f"odd.{form}"
        if form is EventFormat.PARQUET:
            (row,) = pyarrow.parquet.read_table(path).to_pylist()
        else:
            (row,) = csv.DictReader(path.open())
        assert json.loads(row["empty"]) == {}
        assert json.loads(row["empties"]) == [{}, {}]
        assert int(row["side"]) == 0
        assert int(row["last"]) == 9

    def test_names_that_differ_in_case_alone(
        self, listing: Listing, listed: Listed, tmp_path: Path
    ) -> None:
        """Also beside a number that JSON may not hold, for whose sake each member is read."""
        real = "floating_point { exp_dig = 8; mant_dig = 24; align = 8; }"
        path = one_event(
            tmp_path / "t", f"struct {{ {real} _a; {BYTE} _A; }} _s;", struct.pack("<fB", 0.5, 7)
        )
        assert "s={a=0.5, A=7}" in listing(path)
        assert listed(path)[0]["fields"]["s"] == {"a": 0.5, "A": 7}

    @pytest.mark.thorough
    def test_many_fields(self, listing: Listing, listed: Listed, tmp_path: Path) -> None:
        fields = "".join(f"{BYTE} _f{n};" for n in range(600))
        inner = "".join(f"{BYTE} _g{n};" for n in range(600))
        path = one_event(tmp_path / "t", f"{fields} struct {{ {inner} }} _s;", bytes([7] * 1200))
        line = listing(path)
        assert "f0=7" in line
        assert "g599=7}" in line
        assert listed(path)[0]["fields"]["f599"] == 7

    @pytest.mark.thorough
    def test_deep_fields(self, listing: Listing, listed: Listed, tmp_path: Path) -> None:
        path = one_event(tmp_path / "t", f"{BYTE} _a{'[1]' * 28};", b"\x07")
        assert f"a={'[' * 28}7{']' * 28}" in listing(path)
        assert str(listed(path)[0]["fields"]["a"]).count("[") == 28
        structs = "struct { " * 28 + f"{BYTE} _a;" + " } _a;" * 28
        path = one_event(tmp_path / "u", structs, b"\x07")
        assert "a=7" in listing(path)
        real = "floating_point { exp_dig = 8; mant_dig = 24; align = 8; }"
        path = one_event(tmp_path / "v", f"{real} _a[1][1][1];", struct.pack("<f", float("nan")))
        assert "nan" in listed(path)[0]["fields"]["a"][0][0]


class TestTimeless:
    """Events without any clock are in the order of the streams."""

    @pytest.fixture
    def trace(self, tmp_path: Path) -> Path:
        metadata = """stream {
            packet.context := struct { uint8_t content_size; uint8_t packet_size;
                uint8_t timestamp_begin; uint8_t timestamp_end; };
            event.header := struct { uint8_t id; uint8_t timestamp; }; };
            event { name = "one"; id = 1; fields := struct { uint8_t _n; }; };
            event { name = "two"; id = 2; fields := struct { uint8_t _n; }; };"""

        def stream(first: int) -> bytes:
            content = b""
            for packet in range(3):
                number = first + 2 * packet
                # What is called a time is one of no clock: it falls.
                times = bytes([90 - number, 80 - number])
                events = bytes([1, 90 - number, number, 2, 10, number + 1])
                content += bytes([80, 80]) + times + events
            return content

        return write(tmp_path / "timeless", metadata, b=stream(10), a=stream(0))

    def test_order(self, listed: Listed, trace: Path) -> None:
        events = listed(trace)
        assert [event["fields"]["n"] for event in events] == [*range(6), *range(10, 16)]
        assert {event["ts_ns"] for event in events} == {None}
        assert [event["name"] for event in events] == ["one", "two"] * 6

    def test_text(self, listing: Listing, trace: Path) -> None:
        assert listing(trace).splitlines()[0] == "- - -/-/- [-] one n=0"

    def test_beside_a_trace_with_times(self, listed: Listed, trace: Path, tmp_path: Path) -> None:
        content = TraceContent({"x": {}}, {0: [Packet([Event(3, "x")])]})
        other = write_trace(tmp_path / "other", content)
        events = listed(trace, other)
        assert len(events) == 13
        assert [event["ts_ns"] for event in events[-2:]] == [None, 1_700_000_000_000_000_003]

    def test_packets_have_no_times_either(self, trace: Path) -> None:
        with msgflow.trace.open([trace]) as traces:
            assert not traces.traces[0].has_time
            assert (traces.traces[0].begin_ns, traces.traces[0].end_ns) == (None, None)
            packets = [b.batch for b in traces.batches({}) if b.name == "packet"]
        assert [
            (row["begin_ns"], row["end_ns"], row["last_event_ns"], row["event_count"])
            for batch in packets
            for row in batch.to_pylist()
        ] == [(None, None, None, 2)] * 6

    def test_a_window_needs_times(self, trace: Path) -> None:
        with (
            msgflow.trace.open([trace]) as traces,
            pytest.raises(UsageError, match=r"no time stamps — .*timeless"),
        ):
            Selection(traces, start="1s")

    def test_a_database_needs_times(self, trace: Path, tmp_path: Path) -> None:
        with pytest.raises(TraceError, match=r"no time stamps — .*timeless") as caught:
            ingest([trace], tmp_path / "db.duckdb")
        assert "msgflow events" in (caught.value.hint or "")
