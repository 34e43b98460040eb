"""Every query, and every public view that does more than to show a table, has a golden case."""

from __future__ import annotations

from pathlib import Path

import pytest
from sql_files import SqlFile, sql_files

TESTS = Path(__file__).resolve().parents[1]
FILES = sql_files()
QUERIES = [file for file in FILES if file.layer == "queries"]
PUBLIC = [file for file in FILES if file.layer == "public"]
# What a view needs to show one table with its times corrected: the clock, and the way to it.
CORRECTION = {
    "derive.corrected_ns",
    "derive.process_clock",
    "store.clock",
    "store.host",
    "store.node",
    "store.thread",
    "store.trace",
}


def has_logic(file: SqlFile) -> bool:
    """Tell whether a public view reads more than the table of its name and the clocks."""
    own_table = f"store.{file.path.stem}"
    return bool(file.references - CORRECTION - {own_table})


def cases(folder: Path) -> list[Path]:
    return list(folder.glob("*/expected.csv"))


@pytest.mark.parametrize("file", QUERIES, ids=str)
def test_every_query_has_a_case(file: SqlFile) -> None:
    assert cases(TESTS / "query" / "cases" / file.header.name)


@pytest.mark.parametrize("file", [file for file in PUBLIC if has_logic(file)], ids=str)
def test_every_public_view_with_logic_has_a_case(file: SqlFile) -> None:
    assert cases(TESTS / "schema" / "cases" / file.header.name)


def test_every_case_belongs_to_something_that_exists() -> None:
    names = {file.header.name for file in FILES}
    for folder in TESTS.glob("*/cases/*"):
        assert folder.name in names, folder


def test_no_expected_output_is_empty() -> None:
    for path in TESTS.glob("*/cases/*/*/expected.csv"):
        assert path.stat().st_size, path
