from __future__ import annotations

import csv
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace
from msgflow.errors import TraceError, UsageError
from msgflow.events.formats import EventFormat
from msgflow.events.selection import Selection
from msgflow.events.tables import write_event_tables

TYPES = {"handle": "x64", "bytes": "u8[]", "vpid": "i32"}


@pytest.fixture
def trace(reader: str, tmp_path: Path) -> Path:
    events = [
        Event(1, "app:start", (255, [1, 2], 9)),
        Event(2, "app/start"),
        Event(3, "app:start", (1, [], 8)),
        Event(4, "App:Start"),
    ]
    content = TraceContent(
        events={"app:start": TYPES, "app/start": {}, "App:Start": {}, "app:never": {}},
        streams={0: [Packet(events)]},
    )
    return write_trace(tmp_path / "trace", content)


def write(trace: Path, form: EventFormat, directory: Path) -> int:
    with msgflow.trace.open([trace]) as traces:
        return write_event_tables(Selection(traces), form, directory)


def test_parquet_has_a_file_per_event_and_a_column_per_field(trace: Path, tmp_path: Path) -> None:
    assert write(trace, EventFormat.PARQUET, tmp_path / "out") == 4
    names = {path.name: pq.read_table(path) for path in (tmp_path / "out").iterdir()}
    # Names that would be the same for some file system get a number.
    assert set(names) == {"app.start.parquet", "app_start.parquet", "App.Start-2.parquet"}
    table = names["app.start.parquet"]
    assert table.schema.names[-4:] == ["handle", "bytes_length", "bytes", "field_vpid"]
    assert table.schema.field("handle").type == pa.uint64()
    assert table.select(["event_id", "name", "vpid", "bytes", "field_vpid"]).to_pylist() == [
        {"event_id": 0, "name": "app:start", "vpid": 100, "bytes": [1, 2], "field_vpid": 9},
        {"event_id": 2, "name": "app:start", "vpid": 100, "bytes": [], "field_vpid": 8},
    ]


def test_csv_has_lists_as_json(trace: Path, tmp_path: Path) -> None:
    write(trace, EventFormat.CSV, tmp_path / "out")
    with (tmp_path / "out" / "app.start.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["handle"], row["bytes"]) for row in rows] == [("255", "[1,2]"), ("1", "[]")]


def test_small_pieces_are_gathered(
    trace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("msgflow.events.selection.BATCH_ROWS", 1)
    write(trace, EventFormat.PARQUET, tmp_path / "few")
    monkeypatch.setattr("msgflow.events.tables.MOST_BYTES_HELD", 1)
    write(trace, EventFormat.PARQUET, tmp_path / "many")
    few, many = (pq.ParquetFile(tmp_path / name / "app.start.parquet") for name in ("few", "many"))
    assert (few.num_row_groups, many.num_row_groups) == (1, 2)
    assert few.read().equals(many.read())


def test_a_full_directory_is_left_alone(trace: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    assert write(trace, EventFormat.CSV, tmp_path / "out") == 4
    before = sorted((tmp_path / "out").iterdir())
    with pytest.raises(UsageError, match="not empty"):
        write(trace, EventFormat.PARQUET, tmp_path / "out")
    assert sorted((tmp_path / "out").iterdir()) == before


def test_nothing_is_left_of_what_failed(
    trace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(self: Selection, progress: object) -> None:
        raise TraceError("damaged")

    monkeypatch.setattr(Selection, "rounds", fail)
    with pytest.raises(TraceError):
        write(trace, EventFormat.CSV, tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["trace"]
    (tmp_path / "file").touch()
    with pytest.raises(UsageError, match="cannot create the directory: not a directory"):
        write(trace, EventFormat.CSV, tmp_path / "file" / "out")
