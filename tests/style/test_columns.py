"""Golden rows tell the columns of a query apart: an expression in place of another shows."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import pytest
from support import golden
from support.sql_files import SqlFile, sql_files

CASES = Path(__file__).resolve().parents[1] / "query" / "cases"
QUERIES = [file for file in sql_files() if file.layer == "queries"]
NUMBERS = {"BIGINT", "INTEGER", "DOUBLE"}


def numeric(file: SqlFile) -> list[str]:
    return [column.name for column in file.header.columns if column.type in NUMBERS]


@pytest.mark.parametrize("file", QUERIES, ids=str)
def test_no_two_numbers_are_equal_in_all_rows(file: SqlFile) -> None:
    rows: list[dict[str | None, str | None]] = []
    for path in sorted((CASES / file.header.name).glob("*.case")):
        names, *lines = golden.parse_csv(golden.read_case(path).expected)
        rows += [dict(zip(names, line, strict=True)) for line in lines]
    alike = [
        pair
        for pair in combinations(numeric(file), 2)
        if all(row[pair[0]] == row[pair[1]] for row in rows)
    ]
    assert rows
    assert not alike
