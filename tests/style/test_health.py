"""Findings are declared once, in `schema/health`; code and documents use the names from there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import duckdb
import pytest
from support.each import each
from support.sql_files import SqlFile, sql_files

from msgflow.db.finding import SEVERITIES, kinds, kinds_of, phase_of, short_name
from msgflow.sql.header import Header
from msgflow.sql.statement import Statements

ROOT = Path(__file__).resolve().parents[2]
HEALTH = Statements(ROOT / "schema" / "health")
TESTS = ROOT / "tests"
READERS = [
    file
    for file in sql_files()
    if {"main.finding", "store.finding"} & set(file.header.needs)
    and file.header.name != "main.finding"
]
NAMES = {short_name(header) for header in kinds()}
CODE = [*(ROOT / "msgflow").rglob("*.py"), *(ROOT / "schema").glob("*/**/*.sql")]


@each(kinds(), name=lambda header: header.name)
def test_a_finding_says_what_it_means_and_what_to_do(header: Header) -> None:
    assert header.title != header.name
    assert header.severity in SEVERITIES
    assert header.grain
    assert header.cause
    assert header.cure


@each(kinds(), name=lambda header: header.name)
def test_the_folder_decides_what_a_finding_reads(header: Header) -> None:
    assert phase_of(header) in ("input", "recording", "database")
    is_input = phase_of(header) == "input"
    assert all(need.startswith("staging.") == is_input for need in header.needs)


@pytest.fixture(scope="module")
def connection(empty_database: Path) -> Iterator[duckdb.DuckDBPyConnection]:
    with duckdb.connect(str(empty_database), read_only=True) as con:
        yield con


@each([*kinds_of("recording"), *kinds_of("database")], name=lambda header: header.name)
def test_a_finding_about_a_stored_run_says_which(
    header: Header, connection: duckdb.DuckDBPyConnection
) -> None:
    """Without `run_id` it would be found, and not stored."""
    found = HEALTH.run(connection, short_name(header), {"run_id": 1, "broken": []})
    assert "run_id" in found.columns


def test_findings_are_written_in_one_place() -> None:
    """Nothing else puts rows into their table."""
    writing = re.compile(r"INSERT INTO (?:store|staging)\.finding\b|CREATE .*\bfinding\b")
    found = {path.name for path in CODE if writing.search(path.read_text(encoding="utf-8"))}
    assert found == {"finding.py"}


@each(READERS)
def test_findings_that_sql_asks_for_are_declared(file: SqlFile) -> None:
    body = file.header.body
    lists = re.findall(r"\bname (?:=|IN) \(?('\w+'(?:, '\w+')*)", body)
    assert set(re.findall(r"'(\w+)'", " ".join(lists))) <= NAMES


def test_findings_that_documents_name_are_declared() -> None:
    for path in [*(ROOT / "docs").glob("*.md"), ROOT / "README.md"]:
        text = path.read_text(encoding="utf-8")
        assert set(re.findall(r"\bfindings?\s+`(\w+)`", text)) <= NAMES, path


@each(sorted(NAMES))
def test_every_finding_is_tested(name: str) -> None:
    """By a golden case of its own, or by a test that tells what leads to it."""
    rooms = ("model", "ingest", "clocks", "links", "db")
    assert list((TESTS / "schema" / "cases" / f"finding.{name}").glob("*.case")) or any(
        re.search(rf"\b{name}\b", path.read_text(encoding="utf-8"))
        for room in rooms
        for path in (TESTS / room).rglob("*.py")
    )
