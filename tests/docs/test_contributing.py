"""CONTRIBUTING.md names every room, and files where they lie; its first change works."""

from __future__ import annotations

import re
from pathlib import Path

import duckdb
import pytest

from msgflow.sql.header import parse

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
NAMED = re.findall(r"`([\w./-]+)`", TEXT)
PLACES = ("msgflow", "schema", "tests", "docs", "benchmarks", "queries")
ROOMS = [
    folder
    for parent in (
        "msgflow",
        "schema",
        "schema/model",
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


def test_the_query_of_the_first_change_is_one(empty_database: Path) -> None:
    (sql,) = re.findall(r"cat > queries/[\w-]+\.sql <<'END'\n(.*?)END\n", TEXT, re.DOTALL)
    header = parse(sql, ROOT / "CONTRIBUTING.md")
    with duckdb.connect(str(empty_database), read_only=True) as con:
        columns = con.sql(header.body, params={"runs": [1]}).columns
    assert columns == [column.name for column in header.columns]
