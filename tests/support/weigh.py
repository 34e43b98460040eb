"""What msgflow weighs, in figures that neither layout nor a clock moves; run it to print them.

Tests, the simulator, comments and lists of columns (`store.sql`, `model.sql`) do not count.
"""

from __future__ import annotations

import io
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import typer

from msgflow.cli.app import COMMANDS, app
from msgflow.db import objects
from msgflow.sql.header import Header

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("msgflow", "schema", "queries", "migrations")
COLUMNS = {ROOT / "schema" / "store.sql", ROOT / "schema" / "model.sql"}
# What makes tables of staged events, one pass after the other: a pass has levels of its own.
PASSES = tuple(map(objects.load, objects.MODEL_LAYERS))
LAYOUT = {
    tokenize.COMMENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
    tokenize.INDENT,
    tokenize.NEWLINE,
    tokenize.NL,
}
COMMENT = re.compile(r"--.*")
WORD = re.compile(r"[A-Za-z_][A-Za-z_0-9.]*|\d+")


def _files(suffix: str) -> Iterator[Path]:
    for room in ROOMS:
        yield from (path for path in (ROOT / room).rglob(f"*{suffix}") if path not in COLUMNS)


def python_tokens() -> int:
    """Return the number of tokens of all Python, without comments and layout."""
    return sum(
        token.type not in LAYOUT
        for path in _files(".py")
        for token in tokenize.generate_tokens(io.StringIO(path.read_text()).readline)
    )


def sql_words() -> int:
    """Return the number of names, keywords and numbers of all SQL, without comments."""
    return sum(len(WORD.findall(COMMENT.sub("", path.read_text()))) for path in _files(".sql"))


def model_objects() -> int:
    """Return how many files make something of staged events."""
    return len({header.path for made in PASSES for header in made})


def model_levels() -> int:
    """Return the longest chain of files of a pass in which each reads the one before."""
    return max(map(_levels, PASSES))


def _levels(made: Sequence[Header]) -> int:
    headers = {header.name: header for header in made}
    levels: dict[Path, int] = {}
    # Each comes after those that it needs.
    for name, header in headers.items():
        below = {headers[source].path for source in objects.sources(headers, name)}
        level = 1 + max((levels[path] for path in below - {header.path}), default=0)
        levels[header.path] = max(level, levels.get(header.path, 0))
    return max(levels.values())


def _commands() -> Iterator[Any]:
    """Yield all commands, those of groups and the named queries, too."""
    root: Any = typer.main.get_command(app)
    yield root
    waiting = [(typer.Context(root, info_name="msgflow"), root, name) for name in COMMANDS]
    while waiting:
        context, group, name = waiting.pop()
        _, command, _ = group.resolve_command(context, [name])
        yield command
        if hasattr(command, "list_commands"):
            inner = typer.Context(command, info_name=name, parent=context)
            waiting += [(inner, command, each) for each in command.list_commands(inner)]


def commands() -> int:
    """Return how many commands a user can run; groups do not count."""
    return sum(not hasattr(command, "list_commands") for command in _commands())


def options() -> int:
    """Return how many options all commands have together, without those that are hidden."""
    return sum(
        parameter.param_type_name == "option" and not parameter.hidden
        for command in _commands()
        for parameter in command.params
    )


def planned_operators() -> int:
    """Return how many operators DuckDB plans for a small ingest."""
    program = Path(__file__).with_name("planned_operators.py")
    words = [sys.executable, program, ROOT / "examples" / "pipeline.tar.xz"]
    return int(subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True).stdout)


WEIGHTS = (
    python_tokens,
    sql_words,
    model_objects,
    model_levels,
    planned_operators,
    commands,
    options,
)

if __name__ == "__main__":
    for weight in WEIGHTS:
        print(f"{weight.__name__} = {weight()}")
