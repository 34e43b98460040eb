from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from msgflow import Database

Msgflow = Callable[..., Result]


@pytest.mark.thorough
def test_the_suffix_or_the_option_chooses_the_format(
    msgflow: Msgflow, small_database: Path, tmp_path: Path
) -> None:
    with Database(small_database) as database:
        graph = database.graph()
    result = msgflow("graph", "--db", small_database)
    assert (result.exit_code, result.stdout) == (0, f"{graph.to_dot()}\n")
    assert result.stderr.startswith("run: noon (2)\n")
    for name, text in (
        ("a.json", graph.to_json()),
        ("a.mmd", graph.to_mermaid()),
        ("a.gv", graph.to_dot()),
    ):
        result = msgflow("graph", "-o", tmp_path / name, "--db", small_database)
        assert (result.exit_code, result.stdout) == (0, "")
        assert (tmp_path / name).read_text(encoding="utf-8") == f"{text}\n"
    result = msgflow("graph", "--format", "json", "--run", "noon", "--db", small_database)
    assert json.loads(result.stdout)["run"] == "noon"


def test_mistakes_have_code_2(msgflow: Msgflow, small_database: Path, tmp_path: Path) -> None:
    for options, message in (
        (("-o", tmp_path / "a.png"), "a.png"),
        (("--run", "all"), "one run"),
        (("--format", "png"), "--format"),
        (("--format", "svg"), "dot -Tsvg"),
        (("-o", tmp_path / "a.svg"), "dot -Tsvg"),
    ):
        result = msgflow("graph", *options, "--db", small_database)
        assert result.exit_code == 2
        assert message in result.stderr
        assert "\n\nhint: " in result.stderr
    assert not list(tmp_path.glob("a.*"))


@pytest.mark.thorough
def test_it_has_rows_as_a_query(msgflow: Msgflow, small_database: Path, tmp_path: Path) -> None:
    with Database(small_database) as database:
        rows = database.query("graph", sort="name").to_arrow().to_pylist()
    result = msgflow("graph", "--format", "jsonl", "--sort", "name", "--db", small_database)
    assert [json.loads(line) for line in result.stdout.splitlines()] == rows
    result = msgflow("graph", "-o", tmp_path / "a.csv", "--columns", "name", "--db", small_database)
    assert result.exit_code == 0
    names = (tmp_path / "a.csv").read_text().splitlines()[1:]
    assert sorted(names) == sorted(f'"{row["name"]}"' for row in rows)
    result = msgflow("graph", "--format", "json", "--times", "iso", "--db", small_database)
    assert result.exit_code == 2
    assert "--times" in result.stderr


@pytest.mark.parametrize("words", [("--columns", "from"), ("--wide",), ("--times", "ns")])
def test_what_is_about_rows_is_refused_for_a_picture(
    msgflow: Msgflow, small_database: Path, words: tuple[str, ...]
) -> None:
    result = msgflow("graph", *words, "--db", small_database)
    assert result.exit_code == 2
    assert f"{words[0]} is about rows — dot\n\nhint: --format table" in result.stderr


def test_help_names_the_formats_of_a_picture(msgflow: Msgflow) -> None:
    assert "dot, mermaid or json" in " ".join(msgflow("graph", "--help").stdout.split())
