"""`~` behind the `=` of an option, which no shell replaces."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from msgflow.cli.app import app
from msgflow.cli.query import app as query_app
from msgflow.cli.tilde import PATH_OPTIONS, with_home

HOME = "/home/robot"


@pytest.fixture(autouse=True)
def home(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", HOME)


@pytest.mark.parametrize(
    ("word", "expanded"),
    [
        ("--db=~/x.duckdb", f"--db={HOME}/x.duckdb"),
        ("--db=~", f"--db={HOME}"),
        ("-o~/x.csv", f"-o{HOME}/x.csv"),
        ("--clock-sync=~/clocks.yaml", f"--clock-sync={HOME}/clocks.yaml"),
        ("--host=robot=~/traces", f"--host=robot={HOME}/traces"),
        ("--db=~nobody-has-this-name/x", "--db=~nobody-has-this-name/x"),
        ("--db=./~/x", "--db=./~/x"),
        ("--from=~/image", "--from=~/image"),
        ("--name=~", "--name=~"),
        ("~/traces", "~/traces"),
    ],
)
def test_paths_of_options_only(word: str, expanded: str) -> None:
    assert with_home(["ingest", word]) == ["ingest", expanded]
    assert with_home(["ingest", "--", word]) == ["ingest", "--", word]


def commands(command: Any) -> Iterator[Any]:
    yield command
    for inner in getattr(command, "commands", {}).values():
        yield from commands(inner)


def test_the_options_that_take_paths_are_known() -> None:
    query = get_command(query_app)
    everything = [*commands(get_command(app)), query.get_command(None, "e2e-latency")]
    found, others = set(), set()
    for command in everything:
        for parameter in command.params:
            is_path = re.search(r"FILE|DIR|PATH", parameter.metavar or "")
            (found if is_path else others).update(parameter.opts)
    assert found >= PATH_OPTIONS
    assert {option for option in found if option.startswith("-")} == PATH_OPTIONS
    # That of queries is the name of a host, that of a fleet one of two words.
    assert others & PATH_OPTIONS <= {"--host", "--clock-sync"}


def test_a_database_below_the_home_directory(
    msgflow: Any, small_database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(small_database.parent))
    done = msgflow("info", f"--db=~{os.sep}{small_database.name}")
    assert done.exit_code == 0, done.stderr
    assert "morning" in done.stdout
    done = msgflow("sql", "SELECT 1", f"--db=~/{small_database.name}", "-o~/one.csv")
    assert done.exit_code == 0, done.stderr
    assert (small_database.parent / "one.csv").read_text().split() == ['"1"', "1"]
