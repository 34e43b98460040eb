from __future__ import annotations

import io
import json
from datetime import datetime
from decimal import Decimal
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rich.cells import cell_len

from msgflow.export.formats import Format, format_of, write_csv, write_result
from msgflow.result.query_result import QueryResult
from msgflow.sql.header import parse

BIG = 9_007_199_254_740_993
HEADER = parse(
    "-- description: x\n-- column: topic VARCHAR  Topic\n"
    "-- column: median_ns BIGINT [ns]  Half\n-- column: rate_hz DOUBLE [Hz]  Rate\nSELECT 1\n",
    Path("example.sql"),
)


@pytest.fixture
def result() -> QueryResult:
    table = pa.table(
        {
            "topic": ["/größe", "", None],
            "median_ns": pa.array([562_411, BIG, None], pa.int64()),
            "rate_hz": [199.98765, None, 0.5],
        }
    )
    return QueryResult(table, HEADER)


def written(result: QueryResult, form: Format) -> bytes:
    stream = io.BytesIO()
    write_result(result, form, stream)
    return stream.getvalue()


def test_table(result: QueryResult) -> None:
    assert written(result, Format.TABLE).decode().splitlines() == [
        "topic          median  rate_hz",
        "──────────────────────────────",
        "/größe     562.411 µs  199.988",
        "        9007199.255 s        -",
        "-                   -    0.500",
    ]


def test_markdown(result: QueryResult) -> None:
    assert written(result, Format.MARKDOWN).decode() == (
        "| topic | median | rate_hz |\n"
        "| --- | ---: | ---: |\n"
        "| /größe | 562.411 µs | 199.988 |\n"
        "|  | 9007199.255 s | - |\n"
        "| - | - | 0.500 |\n"
    )


def test_markdown_keeps_bars_inside_of_cells() -> None:
    table = QueryResult(pa.table({"symbol": ["operator|"]}))
    assert written(table, Format.MARKDOWN).decode().splitlines()[2] == "| operator\\| |"


def test_csv_tells_null_from_empty_text_and_is_exact(result: QueryResult) -> None:
    assert written(result, Format.CSV).decode() == (
        f'"topic","median_ns","rate_hz"\n"/größe",562411,199.98765\n"",{BIG},\n,,0.5\n'
    )


def test_csv_for_a_spreadsheet_holds_no_formulas() -> None:
    texts = ["=cmd|'x'!A1", "+1+1", "-2", "@SUM(A1)", "\t=1", "\r=1", "a=b", "/topic", None]
    table = QueryResult(pa.table({"=name": texts, "ns": [-1] * len(texts)}))
    plain = written(table, Format.CSV).decode()
    safe = written(table, Format.CSV_SAFE).decode()
    assert "\"'=cmd" in safe
    assert safe.replace("\"'", '"') == plain
    assert safe.count("\"'") == 7


def test_json_is_exact(result: QueryResult) -> None:
    rows = result.table.to_pylist()
    assert json.loads(written(result, Format.JSON)) == rows
    lines = written(result, Format.JSONL).decode().splitlines()
    assert [json.loads(line) for line in lines] == rows


def test_parquet_is_exact(result: QueryResult) -> None:
    data = written(result, Format.PARQUET)
    assert pq.read_table(io.BytesIO(data)).to_pylist() == result.table.to_pylist()


def test_no_rows() -> None:
    empty = QueryResult(pa.table({"a": pa.array([], pa.int64())}))
    assert written(empty, Format.TABLE) == "a\n─\n".encode()
    assert written(empty, Format.CSV) == b'"a"\n'
    assert json.loads(written(empty, Format.JSON)) == []
    assert written(empty, Format.JSONL) == b""
    assert written(empty, Format.MARKDOWN) == b"| a |\n| ---: |\n"


def test_no_columns() -> None:
    nothing = QueryResult(pa.table({}))
    assert written(nothing, Format.TABLE) == b""
    assert written(nothing, Format.JSON) == b"[]\n"


def test_unusual_types_are_written_without_loss() -> None:
    table = pa.table(
        {
            "gid": [b"\x01\xff"],
            "total": pa.array([Decimal(10**30)], pa.decimal128(38, 0)),
            "ids": [[1, 2]],
            "when": [datetime(2026, 1, 2, 3, 4, 5, 6)],
            "kind": pa.array(["a"]).dictionary_encode(),
            "odd": [float("inf")],
        }
    )
    result = QueryResult(table)
    assert json.loads(written(result, Format.JSONL)) == {
        "gid": "01ff",
        "total": 10**30,
        "ids": [1, 2],
        "when": "2026-01-02T03:04:05.000006",
        "kind": "a",
        "odd": None,
    }
    assert written(result, Format.CSV).decode().splitlines()[1] == (
        f'"01ff",{10**30},"[1, 2]","2026-01-02T03:04:05.000006","a",inf'
    )


def test_a_wide_table_is_never_cut_and_wide_letters_align() -> None:
    table = QueryResult(pa.table({"name": ["漢字", "x" * 500], "next": ["a", "b"]}))
    lines = written(table, Format.TABLE).decode().splitlines()
    assert lines[2] == "漢字" + " " * 496 + "  a"
    assert lines[3] == "x" * 500 + "  b"


@pytest.mark.parametrize(
    ("title", "shown"),
    [("a\tb", "a\\tb"), ("\x1b[1mb", "\\x1b[1mb"), ("漢字", "漢字"), ("e\u0301", "e\u0301")],
)
def test_cells_stand_below_any_title(title: str, shown: str) -> None:
    table = QueryResult(pa.table({title: [1], "next": ["a"]}))
    lines = written(table, Format.TABLE).decode().splitlines()
    assert lines[0] == f"{shown}  next"
    assert len(lines[1]) == cell_len(lines[0])
    assert lines[2] == "1".rjust(cell_len(shown)) + "  a"


@pytest.mark.parametrize(
    ("name", "form"),
    [
        ("x.csv", Format.CSV),
        ("x.JSON", Format.JSON),
        ("x.jsonl", Format.JSONL),
        ("x.md", Format.MARKDOWN),
        ("x.parquet", Format.PARQUET),
        ("x.txt", Format.TABLE),
        (None, Format.TABLE),
    ],
)
def test_the_suffix_chooses_the_format(name: str | None, form: Format) -> None:
    assert format_of(None if name is None else Path(name)) is form


class Screen(io.BytesIO):
    """A terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("is_safe", [False, True])
def test_a_row_of_csv_is_one_line_of_a_terminal(is_safe: bool) -> None:
    table = pa.table({"na\nme": ["/a\nmsgflow sql"]})
    file, screen = io.BytesIO(), Screen()
    for stream in (file, screen):
        write_csv(table.schema, table.to_batches(), stream, is_safe=is_safe)
    assert file.getvalue() == b'"na\nme"\n"/a\nmsgflow sql"\n'
    assert screen.getvalue() == b'"na\\nme"\n"/a\\nmsgflow sql"\n'
