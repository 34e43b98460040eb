"""CONTRIBUTING.md names every room, and files where they lie; its first change works."""

from __future__ import annotations

import re
from pathlib import Path

import duckdb
import pytest
from support.golden import fill_case
from support.header_rules import faults
from support.sql_layout import wrong_lines

from msgflow.sql.header import parse

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
NAMED = re.findall(r"`([\w./-]+)`", TEXT)
PLACES = ("msgflow", "schema", "tests", "docs", "benchmarks", "queries", "simulator")
ROOMS = [
    folder
    for parent in (
        "msgflow",
        "simulator",
        "schema",
        "schema/model",
        "schema/kernel",
        "schema/link",
        "schema/stat",
        "schema/health",
    )
    for folder in sorted((ROOT / parent).iterdir())
    if folder.is_dir() and folder.name not in ("__pycache__", "_data")
]


@pytest.mark.parametrize(
    "name", [n for n in NAMED if "/" in n and n.split("/")[0] in PLACES and n == n.lower()]
)
def test_every_place_exists(name: str) -> None:
    assert (ROOT / name).exists()


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: str(room.relative_to(ROOT)))
def test_every_room_is_named(room: Path) -> None:
    assert any(room.name in name.split("/") for name in NAMED)


def written(path: str) -> str:
    """What the first change writes into a file."""
    (text,) = re.findall(rf"cat > {path} <<'END'\n(.*?)END\n", TEXT, re.DOTALL)
    return str(text)


def test_the_query_and_the_golden_case_of_the_first_change_work(
    fresh_database: Path, tmp_path: Path
) -> None:
    text = written("queries/node-timers.sql")
    header = parse(text, ROOT / "queries" / "node-timers.sql")
    assert list(faults(text, header)) == []
    assert list(wrong_lines(text)) == []
    case = tmp_path / "two_timers.case"
    case.write_text(written("tests/query/cases/node-timers/two_timers.case"))
    with duckdb.connect(str(fresh_database)) as con:
        fill_case(con, case)
        answer = con.sql(header.body, params={"runs": [1]})
        assert answer.columns == [column.name for column in header.columns]
        assert answer.fetchall() == [(1, "/talker", 2)]
