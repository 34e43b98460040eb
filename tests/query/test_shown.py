"""Results as they show themselves: printed, and in a notebook."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path

import pyarrow as pa

from msgflow.query.header import parse
from msgflow.query.result import QueryResult

HEADER = parse(
    "-- name: example\n-- title: An <b>example</b>\n-- description: x\n"
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
    assert lines[-2:] == ["note: the first 50 of 60 rows", "note: a <note>"]
    assert str(result_of(0)).splitlines()[-2] == "note: no rows"


def test_a_notebook_shows_a_table_of_text() -> None:
    parser = Cells()
    parser.feed(result_of(60, HOSTILE)._repr_html_())
    assert set(parser.tags) == {"table", "caption", "thead", "tr", "th", "tbody", "td", "p"}
    assert parser.tags.count("tr") == 51
    assert parser.text[0] == "An <b>example</b>"
    assert '</td><script>alert(1)</script>"\\x1b[31m' in parser.text
    assert parser.text[-2:] == ["the first 50 of 60 rows", "a <note>"]
