"""The help of every command fits two screens."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from importlib import import_module

import pytest
import typer
from rich.cells import cell_len
from support.each import each
from typer.testing import Result

from msgflow.cli.app import COMMANDS
from msgflow.query.catalogue import load_queries

Msgflow = Callable[..., Result]
COLUMNS = 80
LINES = 2 * 40


def commands() -> Iterator[str]:
    """Yield every command: those of groups too, and every query with its variants."""
    for name in COMMANDS:
        yield name
        module = import_module(f"msgflow.cli.{name}")
        if name != "query" and hasattr(module, "app"):
            group = typer.main.get_group(module.app)
            yield from (f"{name} {command}" for command in group.list_commands(None))
    yield from (header.command.removeprefix("msgflow ") for header in load_queries())


@each(commands())
def test_it_fits_two_screens(
    command: str, msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    lines = msgflow(*command.split(), "--help").stdout.splitlines()
    assert f"Usage: msgflow {command.partition(' --')[0]}" in lines[0]
    assert len(lines) <= LINES
    assert max(map(cell_len, lines)) <= COLUMNS
    assert not re.findall(r"<[a-z]+[A-Za-z\[\], ]*>", "".join(lines)), "types of Python"


def test_what_every_query_has_stands_once(
    msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    one, every = msgflow("query", "topics", "--help").stdout, msgflow("query", "--help").stdout
    for option in ("--run", "--start", "--format", "--output", "--wide", "--db"):
        assert f"{option} " not in one
        assert re.search(f"{option}( |\n)", every)
    assert "msgflow query --help explains them" in one
    assert "\n  --topic" in one
