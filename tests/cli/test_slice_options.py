"""Commands get the options of a slice as one value."""

from __future__ import annotations

from typing import Annotated

import typer
from typer.testing import CliRunner

from msgflow.cli.slice_options import with_slice
from msgflow.run.slice import ALL_RUNS, LATEST, Slice


def asked(app: typer.Typer, *words: str) -> str:
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    return result.output.strip()


def test_four_options_become_a_slice() -> None:
    app = typer.Typer()

    @app.command()
    @with_slice()
    def command(name: str, part: Slice = LATEST) -> None:
        typer.echo(f"{name} {part}")

    given = Slice("first", "1s", "2s", 0.5)
    options = ("--run", "first", "--start", "1s", "--end", "2s", "--skip-first", "0.5")
    assert asked(app, "x", *options) == f"x {given}"
    assert asked(app, "x") == f"x {LATEST}"


def test_a_command_may_have_some_of_them_and_another_default() -> None:
    app = typer.Typer()

    @app.command()
    @with_slice("run", "end", run=Annotated[str, typer.Option("--which")])
    def command(part: Slice = ALL_RUNS) -> None:
        typer.echo(part)

    assert asked(app, "--end", "3") == str(Slice("all", end="3"))
    assert asked(app, "--which", "first") == str(Slice("first"))
    assert CliRunner().invoke(app, ["--start", "3"]).exit_code == 2
