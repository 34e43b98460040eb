"""Options that several commands share: `~` in paths, which no shell replaces in `--db=~/x`."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from typing import Any

import pytest
from typer.main import get_command

from msgflow.cli.app import COMMANDS, app

HOME = "/home/robot"


def commands(group: Any, names: list[str]) -> Iterator[Any]:
    for name in names:
        _, command, _ = group.resolve_command(group.context_class(group), [name])
        yield command
        if hasattr(command, "commands"):
            # The queries are alike: one stands for all.
            yield from commands(command, list(command.commands) or ["e2e-latency"])


def test_all_options_that_take_a_path_know_the_home_directory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("HOME", HOME)
    expanded = set()
    for command in commands(get_command(app), [*COMMANDS, "simulate"]):
        for option in command.params:
            if option.param_type_name != "option":
                continue
            # Several paths, with names before them: the test below.
            if re.search(r"FILE|DIR|PATH", option.metavar or "") and not option.multiple:
                value = option.process_value(None, "~/x")
                assert os.fspath(value) == f"{HOME}/x", (command.name, option.name)
                expanded.update(option.opts)
    assert expanded >= {"--db", "-o", "-f", "--links", "--keep-staging", "--clock-sync"}
    assert expanded >= {"--paths", "--lake", "--scratch"}


def test_the_home_directory_in_the_path_of_a_host(
    msgflow: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", HOME)
    msgflow("simulate", "pipeline", "-o", "out", "--factor", 0.02)
    done = msgflow("ingest", "out", "--host=robot=~/traces")
    assert f"host robot — {HOME}/traces" in done.stderr


def test_a_database_below_the_home_directory(
    msgflow: Any, small_database: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(small_database.parent))
    done = msgflow("info", f"--db=~{os.sep}{small_database.name}")
    assert done.exit_code == 0, done.stderr
    assert "morning" in done.stdout
    done = msgflow("sql", "SELECT 1", f"--db=~/{small_database.name}", "-o~/one.csv")
    assert done.exit_code == 0, done.stderr
    assert (small_database.parent / "one.csv").read_text().split() == ['"1"', "1"]
