"""The search for changes of rules that no test notices: it finds both kinds."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from mutants import RULES

ROOT = Path(__file__).resolve().parents[2]
LIMIT = "schema/delivery/delivery_limit.sql"


@pytest.mark.parametrize(
    ("tests", "code", "survived"),
    [
        (
            "tests/schema/test_delivery_rules.py::test_as_many_missing_in_a_row_as_a_queue_holds",
            0,
            0,
        ),
        ("tests/sql/test_value.py", 1, 2),
    ],
)
def test_a_change_is_noticed_by_the_tests_that_are_about_it(
    tests: str, code: int, survived: int
) -> None:
    (line,) = [
        number
        for number, text in enumerate((ROOT / LIMIT).read_text().splitlines(), start=1)
        if "'least_row'" in text
    ]
    done = subprocess.run(
        [sys.executable, "benchmarks/mutants.py", LIMIT, "--line", str(line), "--tests", tests],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert f"2 changes, {survived} survived" in done.stdout, done.stdout + done.stderr
    assert done.returncode == code


@pytest.mark.parametrize(("place", "tests"), RULES, ids=[place for place, _ in RULES])
def test_every_rule_has_its_files_and_tests(place: str, tests: tuple[str, ...]) -> None:
    assert (ROOT / "schema" / place).exists()
    assert all((ROOT / "tests" / "schema" / f"{test}.py").is_file() for test in tests)
