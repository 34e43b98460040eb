"""Words of a command line become what Typer would make of them, mostly without Pydantic."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
import typer.core
import typer.main

from msgflow.cli import words
from msgflow.cli.app import app
from msgflow.cli.outline import SUMMARIES

TYPED = (
    "",
    "x",
    "a/b",
    "~",
    "1",
    "-1",
    "0.5",
    "true",
    "off",
    "csv",
    "table",
    "nearest",
    "a,b",
    "é",
)

# What is said of a parameter for people to read and type; `default` is looked at by itself.
FOR_PEOPLE = {
    "autocompletion",
    "default",
    "help",
    "hidden",
    "metavar",
    "param_decls",
    "rich_help_panel",
    "shell_complete",
    "show_default",
}


def parameters(command: Any, name: str = "msgflow") -> Iterator[tuple[str, Any]]:
    """Yield all parameters of a command and of those below it."""
    for parameter in command.params:
        if hasattr(parameter, "type_descriptor"):
            yield f"{name} {parameter.name}", parameter
    for each in getattr(command, "commands", ()):
        yield from parameters(command.commands[each], f"{name} {each}")


def made(maker: Any, value: Any, parameter: Any) -> tuple[str, Any]:
    context = typer.Context(typer.main.get_command(app))
    try:
        result = maker(parameter.type_descriptor).coerce(value, param=parameter, ctx=context)
    except Exception as error:
        return type(error).__name__, str(error)
    return type(result).__name__, result


def kind(parameter: Any) -> str:
    """Tell apart what becomes of words: by the type, and by all that is said but for people."""
    described = parameter.type_descriptor
    told = {
        name: value
        for name, value in vars(described.parameter_info).items()
        if name not in FOR_PEOPLE
    }
    default = parameter.default if isinstance(parameter.default, str | Path) else None
    return f"{described.annotation} {parameter.multiple} {parameter.nargs} {default!r} {told}"


def test_as_typer_makes_them() -> None:
    """Parameters of one kind once: they are made alike, and there are hundreds."""
    command = typer.main.get_command(app)
    every = {
        name: parameter
        for one in SUMMARIES
        for name, parameter in parameters(command.commands[one], one)
    }
    found = {kind(parameter): (name, parameter) for name, parameter in every.items()}
    assert 10 < len(found) < len(every)
    for name, parameter in found.values():
        is_many = parameter.multiple or parameter.nargs == -1
        given: list[Any] = [None, *TYPED]
        if is_many:
            given += [(), *((word,) for word in TYPED), tuple(TYPED)]
        elif isinstance(parameter.default, str | Path):
            given.append(parameter.default)
        for value in given:
            expected = made(words._by_typer, value, parameter)
            assert made(words._Plainly, value, parameter) == expected, (name, value)


@pytest.mark.parametrize("option", ["exists", "resolve_path"])
def test_what_typer_checks_of_a_path(option: str, tmp_path: Path) -> None:
    checked = typer.Typer(add_completion=False)

    @checked.command()
    def command(path: Path = typer.Argument(..., **{option: True})) -> None:  # noqa: B008
        print(path)

    (parameter,) = typer.main.get_command(checked).params
    for value in (str(tmp_path), str(tmp_path / "none"), "here/../there"):
        expected = made(words._by_typer, value, parameter)
        assert made(words._Plainly, value, parameter) == expected


def test_a_query_does_without_pydantic(small_database: Path) -> None:
    code = (
        "import sys, atexit\n"
        "atexit.register(lambda: print('pydantic' in sys.modules, file=sys.stderr))\n"
        f"sys.argv = ['msgflow', 'query', 'info-topics', '--db', {str(small_database)!r}]\n"
        "from msgflow.__main__ import main\n"
        "main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "/chatter" in done.stdout
    assert done.stderr.splitlines()[-1] == "False"


def test_another_typer_goes_its_own_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("typer.core.build_runtime_param")
    spec = importlib.util.find_spec(words.__name__)
    assert spec is not None
    assert spec.loader is not None
    again = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(again)
    again.plainly()
    again.as_typed()
    assert not hasattr(typer.core, "build_runtime_param")
