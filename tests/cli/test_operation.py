"""Commands come from signatures and docstrings."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer
from typer.testing import CliRunner

from msgflow.backports import Unpack
from msgflow.cli.help import lay_out_help
from msgflow.cli.operation import asks, extends, operation
from msgflow.database import Database
from msgflow.run.slice import SliceWords, TimeWords


def asked(command: Any, *words: str) -> str:
    app = typer.Typer()
    app.command()(command)
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    return result.output.strip()


@operation
def said(
    name: str,
    sizes: Sequence[float] = (),
    *,
    file: Path = Path("a"),
    once: bool = False,
    really: bool = True,
    from_: str | Sequence[str] | None = None,
    most: Annotated[int, typer.Option("--most", "-m", max=9)] = 1,
    **part: Unpack[SliceWords],
) -> None:
    """Say what was given.

    All of [it].

    Args:
        name (WHO): the one who says it.
        sizes: as texts.
        file: where.
        once: only once.
        really: is it so.
        from_: places.
        most: how much.
    """
    typer.echo((name, sizes, file, once, really, from_, most, part))


def test_a_signature_becomes_arguments_and_options() -> None:
    nothing: dict[str, None] = {"run": None, "start": None, "end": None}
    assert asked(said, "x") == str(("x", None, Path("a"), False, True, None, 1, nothing))
    words = ["x", "1", "--file=~/b", "--once", "--no-really", "--from=y", "--from=z", "-m", "3"]
    home = Path.home() / "b"
    given = ("x", ["1"], home, True, False, ["y", "z"], 3, {"run": "r", "start": "1", "end": "2"})
    assert asked(said, *words, "--run=r", "--start=1", "--end=2") == str(given)


def test_a_docstring_becomes_the_help(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    app = typer.Typer()
    app.command()(said)
    command = lay_out_help(typer.main.get_command(app))
    text = " ".join(command.get_help(typer.Context(command, info_name="say")).split())
    for part in (
        "Usage: say [OPTIONS] WHO [SIZES] Say what was given. All of [it].",
        "WHO The one who says it SIZES As texts",
        "--file FILE Where [default: a]",
        "--once Only once",
        "--really, --no-really Is it so [default: --really]",
        "-m, --most NUMBER How much [default: 1; at most 9]",
        "--from NAME Places",
        "--run NAME|ID|all Run to read [default: the latest]",
    ):
        assert part in text


def test_a_command_asks_a_method_of_the_database(monkeypatch: pytest.MonkeyPatch) -> None:
    def method(
        self: Database,
        output: str | Path = "here",
        *,
        run: str | int | None = "all",
        paths: str | Path = "paths.yaml",
        **times: Unpack[TimeWords],
    ) -> dict[str, Any]:
        """Write it."""
        return {"path": self.path, "output": output, "run": run, "paths": paths, **times}

    @asks(method)
    def written(found: dict[str, Any], output: Path, *, loud: bool = False) -> None:
        """Say it.

        Args:
            loud: in capitals.
        """
        typer.echo((found, output, loud))

    found: dict[str, Any] = {
        "path": Path("x.duckdb"),
        "output": Path("here"),
        "run": "all",
        "paths": Path("paths.yaml"),
    }
    assert asked(written, "--db=x.duckdb") == str((found, Path("here"), False))
    given = found | {"output": Path("there"), "run": "1", "end": "3"}
    words = ("--db=x.duckdb", "-o", "there", "--run=1", "--end=3", "--loud")
    assert asked(written, *words) == str((given, Path("there"), True))
    assert written.__doc__ == "Write it.\n\nSay it."


def test_a_command_gets_its_database_and_what_a_method_takes() -> None:
    def method(
        self: Database, place: str | None = None, *, take_id: int | None = None, depth: int = 3
    ) -> None:
        """Ask."""

    @extends(method)
    def command(database: Database, *, depth: str = "far", **asked: Any) -> None:
        typer.echo((database.path, depth, asked))

    @operation
    def alone(database: Database, name: str) -> None:
        typer.echo((database.path, name))

    given = {"place": "x", "take_id": 3}
    assert asked(command, "x", "--take=3", "--db=y.duckdb") == str((Path("y.duckdb"), "far", given))
    assert asked(command, "--depth=2") == str((Path("msgflow.duckdb"), "2", {}))
    assert asked(alone, "n", "--db=y.duckdb") == str((Path("y.duckdb"), "n"))


@pytest.mark.parametrize(
    ("words", "instead"),
    [
        ("why --skip-first 2", "--start SECONDS"),
        ("query flows --skip-first 2", "--start SECONDS"),
        ("export mcap --memory-limit 1GB", "MSGFLOW_MEMORY_LIMIT in the environment"),
    ],
)
def test_an_option_of_before_says_what_is_in_its_place(
    msgflow: Any, words: str, instead: str
) -> None:
    refused = msgflow(*words.split())
    assert refused.exit_code == 2
    assert instead in refused.stderr


def test_a_command_is_made_without_what_it_runs() -> None:
    code = (
        "import sys; from importlib import import_module; from msgflow.cli.app import COMMANDS;"
        "[import_module(f'msgflow.cli.{name}') for name in COMMANDS]; print(*sys.modules)"
    )
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert {"duckdb", "pyarrow", "numpy", "sqlalchemy"} & set(done.stdout.split()) == set()
