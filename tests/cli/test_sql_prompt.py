from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from msgflow.cli.sql import completer, prompt
from msgflow.errors import QueryError


def asked(
    monkeypatch: pytest.MonkeyPatch, database: Path, *lines: str, wrong: str = ""
) -> list[str]:
    """What the prompt asks for when a user types these lines, then Ctrl-D."""
    typed: Iterator[str] = iter(lines)
    queries: list[str] = []

    def type_line(_: str) -> str:
        try:
            return next(typed)
        except StopIteration:
            raise EOFError from None

    def ask(query: str) -> None:
        queries.append(query)
        if query == wrong:
            raise QueryError("not SQL")

    monkeypatch.setattr("builtins.input", type_line)
    prompt(database, ask)
    return queries


def test_a_query_ends_with_a_semicolon_or_an_empty_line(
    monkeypatch: pytest.MonkeyPatch, small_database: Path
) -> None:
    lines = ("", "SELECT 1;", "SELECT", " 2", "", "  ", "FROM run ; ")
    found = asked(monkeypatch, small_database, *lines)
    assert found == ["SELECT 1;", "SELECT\n 2", "FROM run ; "]


def test_the_prompt_goes_on_after_a_mistake(
    monkeypatch: pytest.MonkeyPatch, small_database: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = asked(monkeypatch, small_database, "x;", "SELECT 1;", wrong="x;")
    assert found == ["x;", "SELECT 1;"]
    assert "error: not SQL" in capsys.readouterr().err


@pytest.mark.parametrize("word", ["exit", "QUIT;", "exit ;", ".quit", ".exit"])
def test_words_end_the_prompt(
    monkeypatch: pytest.MonkeyPatch, small_database: Path, word: str
) -> None:
    assert asked(monkeypatch, small_database, "SELECT 1;", word, "SELECT 2;") == ["SELECT 1;"]


def test_questions_of_other_prompts(
    monkeypatch: pytest.MonkeyPatch, small_database: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = (".tables", ".schema take", ".help", ".mode csv", ".schema tak", "SELECT 1;")
    assert asked(monkeypatch, small_database, *lines) == ["SELECT 1;"]
    said = capsys.readouterr()
    views, _, columns = said.out.partition("column ")
    assert "callback_run" in views
    assert "taken_ns" in columns
    assert "callback_run" not in columns
    assert said.err.count(".schema VIEW its columns") == 3
    assert "no such view — tak" in said.err


def test_tab_completes_in_any_case() -> None:
    complete = completer(["take", "take_id", "SELECT"])
    assert [complete("TA", number) for number in range(3)] == ["take", "take_id", None]
    assert complete("sel", 0) == "SELECT"
    assert complete("x", 0) is None
