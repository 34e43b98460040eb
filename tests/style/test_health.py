"""What can be wrong is declared once, in `schema/health`; whoever names it elsewhere names that."""

from __future__ import annotations

import re
from pathlib import Path

from each import each
from sql_files import SqlFile, sql_files

from msgflow.db import check, finding
from msgflow.db.diagnostic import SEVERITIES, diagnostics
from msgflow.sql.header import Header

ROOT = Path(__file__).resolve().parents[2]
TESTS = ROOT / "tests"
FILES = sql_files()
FINDINGS = [file.header for file in FILES if file.layer == "finding"]
AUDITS = [file.header for file in FILES if file.layer == "check"]
READERS = [
    file
    for file in FILES
    if {"main.diagnostic", "store.diagnostic"} & set(file.header.needs)
    and file.header.name != "main.diagnostic"
]
NAMES = {header.name.partition(".")[2] for header in diagnostics()}
CODE = [*(ROOT / "msgflow").rglob("*.py"), *(ROOT / "schema").rglob("*.sql")]


@each(diagnostics(), name=lambda header: header.name)
def test_a_diagnostic_says_what_it_means_and_what_to_do(header: Header) -> None:
    """In words of its own, or by the finding that tells it to people."""
    assert header.title != header.name
    assert header.severity in SEVERITIES
    assert header.phase
    if header.finding is None:
        assert header.cause
        assert header.cure
    else:
        assert not header.cause
        assert not header.cure
        assert f"finding.{header.finding}" in {one.name for one in FINDINGS}


@each(diagnostics(), name=lambda header: header.name)
def test_what_is_stored_of_a_phase_has_a_parameter(header: Header) -> None:
    """Of what was read and built there is one run; of the others, it has to be named."""
    if header.phase in ("reading", "model"):
        assert not header.params
        assert all(need.startswith("staging.") for need in header.needs)
    elif header.phase in ("clocks", "database"):
        assert header.params
    elif not header.params:
        assert "WITH" not in header.body, "older clients find no CTE there"


def test_diagnostics_are_written_in_one_place() -> None:
    """By their declared names: nothing else puts rows into their table."""
    writing = re.compile(r"INSERT INTO (?:store|staging)\.diagnostic\b|CREATE .*\bdiagnostic\b")
    found = {path.name for path in CODE if writing.search(path.read_text(encoding="utf-8"))}
    assert found == {"noted.py"}


@each(READERS)
def test_diagnostics_that_sql_asks_for_are_declared(file: SqlFile) -> None:
    body = file.header.body
    lists = re.findall(r"\bname (?:=|IN) \(?('\w+'(?:, '\w+')*)", body)
    assert set(re.findall(r"'(\w+)'", " ".join(lists))) <= NAMES


def test_diagnostics_and_findings_that_documents_name_are_declared() -> None:
    findings = {header.name.partition(".")[2] for header in FINDINGS}
    for path in [*(ROOT / "docs").glob("*.md"), ROOT / "README.md"]:
        for kind, name in re.findall(
            r"\b(diagnostic|finding)\s+`(\w+)`", path.read_text(encoding="utf-8")
        ):
            assert name in (NAMES if kind == "diagnostic" else findings), path


@each(sorted(NAMES))
def test_every_diagnostic_is_tested(name: str) -> None:
    """By a golden case of its own, or by a test that tells what leads to it."""
    cases = TESTS / "schema" / "cases"
    rooms = ("model", "ingest", "clocks", "links", "db")
    assert list((cases / f"diagnostic.{name}").glob("*.case")) or any(
        re.search(rf"\b{name}\b", path.read_text(encoding="utf-8"))
        for path in [
            *(path for room in rooms for path in (TESTS / room).rglob("*.py")),
            *(cases / "main.diagnostic").glob("*.case"),
        ]
    )


def test_severities_are_those_that_are_sorted_by() -> None:
    assert {header.severity for header in FINDINGS} == set(finding.SEVERITIES)
    # A failed audit is noted as what its diagnostic says.
    (noted,) = (header for header in diagnostics() if header.name == "diagnostic.check_failed")
    assert {header.severity for header in AUDITS} == {noted.severity}
    assert noted.severity == check.RELATION_SEVERITY
