"""Options of a query come from its header."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from typer.testing import Result

from msgflow.database import Database
from msgflow.result.query_result import QueryResult
from msgflow.sql.header import parse

Msgflow = Callable[..., Result]
HEADER = parse(
    """\
-- title: An example
-- description: What [it] means.
-- param: from VARCHAR = NULL     Where it starts
-- param: max_depth BIGINT = 32     How deep
-- param: case VARCHAR {first|last} = 'first'     Which
-- param: is_strict BOOLEAN = false     Whether
-- param: topic VARCHAR     Has to be given
-- column: at_ns BIGINT [epoch ns]  When
SELECT 1
""",
    Path("example.sql"),
)


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """The arguments of every query that was asked."""
    seen: list[dict[str, Any]] = []

    def query(_: Database, name: str, **arguments: Any) -> QueryResult:
        seen.append({"name": name} | arguments)
        return QueryResult(pa.table({"at_ns": [1]}), HEADER)

    for function in ("query.load_query", "query_command.load_query", "query_command.choose_query"):
        monkeypatch.setattr(f"msgflow.cli.{function}", lambda *_: HEADER)
    monkeypatch.setattr(Database, "query", query)
    return seen


def test_what_is_not_given_is_left_to_the_header(
    msgflow: Msgflow, calls: list[dict[str, Any]]
) -> None:
    assert msgflow("query", "example", "--topic", "/a").exit_code == 0
    assert calls == [
        {
            "name": "example",
            "topic": "/a",
        }
    ]


def test_everything_that_is_given_arrives(msgflow: Msgflow, calls: list[dict[str, Any]]) -> None:
    own = ("--from", "/b", "--max-depth", "3", "--case", "last", "--is-strict", "--topic", "/a")
    common = ("--run", "x", "--start", "1s", "--end", "2s", "--internal")
    assert msgflow("query", "example", *own, *common).exit_code == 0
    assert calls == [
        {
            "name": "example",
            "from": "/b",
            "max_depth": "3",
            "case": "last",
            "is_strict": True,
            "topic": "/a",
            "run": "x",
            "start": "1s",
            "end": "2s",
            "internal": True,
        }
    ]
    msgflow("query", "example", "--topic", "/a", "--no-is-strict")
    assert calls[1]["is_strict"] is False


def test_a_parameter_without_default_has_to_be_given(
    msgflow: Msgflow, calls: list[dict[str, Any]]
) -> None:
    result = msgflow("query", "example")
    assert result.exit_code == 2
    assert result.stderr.startswith("error: missing option '--topic'\n\nhint: ")
    assert calls == []


def test_help_shows_types_choices_defaults_columns_and_brackets(
    msgflow: Msgflow, calls: list[dict[str, Any]]
) -> None:
    words = " ".join(msgflow("query", "example", "--help").stdout.split())
    for part in (
        "An example. What [it] means.",
        "--from NAME Where it starts",
        "--max-depth NUMBER How deep [default: 32]",
        "--case WORD Which (first, last) [default: first]",
        "Whether",
        "Columns: at_ns; --show explains them",
    ):
        assert part in words
    assert calls == []


def test_units_of_the_header_reach_the_table(msgflow: Msgflow, calls: list[dict[str, Any]]) -> None:
    result = msgflow("query", "example", "--topic", "/a")
    assert result.stdout.splitlines()[2] == "1970-01-01T00:00:00.000000001Z"
    assert len(calls) == 1
