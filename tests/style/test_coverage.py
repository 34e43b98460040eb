"""Queries, public views that do more than to show a table, and page queries have golden cases."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from support.each import each
from support.golden import SYSTEMS, read_case
from support.sql_files import SqlFile, sql_files

from msgflow.db.store_table import table_views
from msgflow.view.page_query import DIRECTORY, page_query

TESTS = Path(__file__).resolve().parents[1]
FILES = sql_files()
QUERIES = [file for file in FILES if file.layer == "queries"]
OF_PROGRAM = [
    file for file in FILES if file.layer in ("internal", "culprit") and file.header.kind != "inline"
]
PUBLIC = [file for file in FILES if file.layer == "public"]
# Those of kind 'inline' are parts of others.
PAGE_QUERIES = sorted(
    f"view.{path.stem}"
    for path in DIRECTORY.glob("*.sql")
    if page_query(path.stem).kind != "inline"
)
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
    return list(folder.glob("*.case"))


@each(QUERIES)
def test_every_query_has_a_case(file: SqlFile) -> None:
    assert cases(TESTS / "query" / "cases" / file.header.name)


@each([file for file in PUBLIC if has_logic(file)])
def test_every_public_view_with_logic_has_a_case(file: SqlFile) -> None:
    assert cases(TESTS / "schema" / "cases" / file.header.name)


@each(OF_PROGRAM)
def test_everything_that_the_program_asks_has_a_case(file: SqlFile) -> None:
    assert cases(TESTS / "schema" / "cases" / file.header.name)


@each(PAGE_QUERIES)
def test_every_page_query_has_a_case(name: str) -> None:
    assert cases(TESTS / "view" / "cases" / name)


def test_every_case_belongs_to_something_that_exists() -> None:
    names = {file.header.name for file in FILES} | set(PAGE_QUERIES)
    names |= {header.name for header in table_views()}
    for folder in TESTS.glob("*/cases/*"):
        assert folder.name in names, folder


def test_no_expected_output_is_empty() -> None:
    for path in TESTS.glob("*/cases/*/*.case"):
        assert read_case(path).expected, path


def test_every_system_belongs_to_several_cases() -> None:
    used = Counter(read_case(path).system for path in TESTS.glob("*/cases/*/*.case"))
    for path in SYSTEMS.glob("*.case"):
        assert used[path.stem] > 1, path


def test_every_system_that_a_case_names_exists() -> None:
    for path in TESTS.glob("*/cases/*/*.case"):
        name = read_case(path).system
        assert name is None or list(SYSTEMS.glob(f"{name}.*")), path
