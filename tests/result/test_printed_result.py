"""Results as they show themselves: printed, and in a notebook."""

from __future__ import annotations

import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pyarrow as pa
import pytest

from msgflow.result.query_result import QueryResult
from msgflow.run.choice import Run
from msgflow.sql.header import parse

HEADER = parse(
    "-- title: An <b>example</b>\n-- description: x\n"
    "-- column: topic VARCHAR  Topic\n-- column: wait_ns BIGINT [ns]  Wait\nSELECT 1\n",
    Path("example.sql"),
)
HOSTILE = '</td><script>alert(1)</script>"\x1b[31m'


def result_of(count: int, name: str = "/scan") -> QueryResult:
    table = pa.table({"topic": [name] * count, "wait_ns": pa.array(range(count), pa.int64())})
    return QueryResult(table, HEADER, notes=["a <note>"])


class Cells(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def test_printing_shows_the_first_rows_with_units_and_notes() -> None:
    assert str(result_of(2)).splitlines() == [
        "topic  wait",
        "───────────",
        "/scan  0 ns",
        "/scan  1 ns",
        "note: a <note>",
    ]
    lines = str(result_of(60)).splitlines()
    assert len(lines) == 2 + 50 + 2
    assert lines[-2:] == ["note: the first 50 of 60 rows: to_arrow() has all", "note: a <note>"]
    assert str(result_of(0)).splitlines()[-2] == "note: no rows"


def test_printing_fits_the_width_of_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    path = " → ".join(f"/node_{number} → /topic_{number}" for number in range(12))
    table = pa.table({"path": [path], "wait_ns": pa.array([7], pa.int64()), "open": [0]})
    header = replace(HEADER, brief=("wait_ns",))
    result = QueryResult(table, header, (Run(3, "a\x1b[31m", 5),), ["long " * 40])
    for columns in (60, 100):
        monkeypatch.setenv("COLUMNS", str(columns))
        lines = str(result).splitlines()
        assert columns - 15 < max(map(len, lines)) <= columns
        assert lines[0] == "run: a\\x1b[31m (3)"
        assert "not shown: open (empty); to_arrow() has all" in lines
        assert any(line.startswith("path  /node_0 → ") for line in lines)
    # No terminal and no COLUMNS: 100.
    monkeypatch.delenv("COLUMNS")
    monkeypatch.setattr(sys, "__stdout__", None)
    assert str(result).splitlines() == lines


def test_printing_says_where_the_columns_are_that_have_no_room(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    names = [f"column_{number}" for number in range(20)]
    table = pa.table({name: [f"value of {name}", "other"] for name in names})
    header = replace(HEADER, brief=tuple(names[:3]))
    monkeypatch.setenv("COLUMNS", "80")
    text = str(QueryResult(table, header))
    assert text.splitlines()[0].split() == names[: len(text.splitlines()[0].split())]
    assert "to_arrow() has" in text
    assert "--wide" not in text


def test_a_notebook_shows_a_table_of_text() -> None:
    parser = Cells()
    parser.feed(result_of(60, HOSTILE)._repr_html_())
    assert set(parser.tags) == {"table", "caption", "thead", "tr", "th", "tbody", "td", "p"}
    assert parser.tags.count("tr") == 51
    assert parser.text[0] == "An <b>example</b>"
    assert '</td><script>alert(1)</script>"\\x1b[31m' in parser.text
    assert parser.text[-2:] == ["the first 50 of 60 rows", "a <note>"]
