"""The search for changes of rules that no test notices: it finds both kinds."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from mutants import RULES, changes
from support.thorough import thorough

ROOT = Path(__file__).resolve().parents[2]
LIMIT = "schema/delivery/delivery_limit.sql"
QUEUES = "tests/schema/test_delivery_rules.py::test_as_many_missing_in_a_row_as_a_queue_holds"
ENDS = "schema/link/gap/early_stream.sql"
DROPPED = ["--replace", "QUALIFY early_ns > 500_000_000", ""]


def numbers_of(file: str, text: str) -> list[str]:
    """Return the options for changes of the only line with this text."""
    lines = (ROOT / file).read_text().splitlines()
    (number,) = (number for number, line in enumerate(lines, start=1) if text in line)
    return ["--line", str(number)]


RULE = """-- 5 < 6
SELECT min(a) FROM t LEFT JOIN u ON t.id = u.id AND t.run_id = u.run_id
WHERE NOT b AND c BETWEEN 2 AND d OR e <> 'x > 3'
UNION ALL SELECT 1"""
CHANGES = {
    "min → max",
    "LEFT  → ",
    " t.id = u.id →  true ",
    "NOT  → ",
    " NOT b →  true ",
    " c BETWEEN 2 AND d →  true ",
    "2 → 4",
    "2 → 1",
    " e <> 'x > 3' →  false ",
    "<> → =",
    "UNION ALL SELECT 1 → ",
}


def test_what_is_changed() -> None:
    """Neither comments nor quotes, nor what only chooses the run."""
    assert {f"{RULE[begin:end]} → {new}" for begin, end, new in changes(RULE)} == CHANGES


# A rule stands on tables that a test makes up; a finding is part of a whole database.
@pytest.mark.thorough
@pytest.mark.parametrize(
    ("file", "options", "tests", "changes", "survived"),
    [
        thorough(LIMIT, numbers_of(LIMIT, "'least_row'"), QUEUES, 2, 0),
        thorough(LIMIT, numbers_of(LIMIT, "'least_row'"), "tests/sql/test_value.py", 2, 2),
        (LIMIT, ["--replace", "'least_row'", "'most_row'"], "tests/sql/test_value.py", 1, 1),
        thorough(ENDS, DROPPED, "tests/schema/cases/finding.stream_ends_early", 1, 0),
    ],
)
def test_a_change_is_noticed_by_the_tests_that_are_about_it(
    file: str, options: list[str], tests: str, changes: int, survived: int
) -> None:
    done = subprocess.run(
        [sys.executable, "benchmarks/mutants.py", file, *options, "--tests", tests],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert f"{changes} changes, {survived} survived" in done.stdout, done.stdout + done.stderr
    assert done.returncode == (survived > 0)


@pytest.mark.parametrize(("place", "tests"), RULES, ids=[place for place, _ in RULES])
def test_every_rule_has_its_files_and_tests(place: str, tests: tuple[str, ...]) -> None:
    assert (ROOT / "schema" / place).exists()
    assert all((ROOT / "tests" / test).exists() for test in tests)
