"""Prompt of `msgflow sql`: one query after the other, with completion of views and columns."""

from __future__ import annotations

import readline
from collections.abc import Callable, Iterable
from pathlib import Path

from msgflow.cli.errors import print_exception
from msgflow.cli.output import print_result, print_status
from msgflow.database import Database
from msgflow.errors import MsgflowError

_WORDS = (
    "SELECT", "FROM", "JOIN", "LEFT JOIN", "USING", "ON", "WHERE", "GROUP BY", "ORDER BY", "LIMIT",
    "count(*)", "avg(", "min(", "max(", "quantile_disc(", "DESCRIBE",
)  # fmt: skip
_END = ("exit", "quit", ".exit", ".quit", ".q")
_HELP = (
    "a query ends with ; or an empty line; tab completes names; .tables lists the views,"
    " .schema VIEW its columns; Ctrl-D ends"
)


def prompt(database: Path, ask: Callable[[str], None]) -> None:
    """Ask for queries until the user ends it with Ctrl-D, `exit` or `quit`."""
    with Database(database) as opened:
        names = opened.schema().to_arrow()
    words = {*names["view"].to_pylist(), *names["column"].to_pylist(), *_WORDS}
    readline.set_completer(completer(words))
    readline.set_completer_delims(" \t\n,()=<>")
    readline.parse_and_bind("tab: complete")
    print_status(_HELP)
    lines: list[str] = []
    while True:
        try:
            line = input("   ...> " if lines else "msgflow> ")
        except EOFError:
            print_status("")
            return
        if not lines and line.strip().rstrip("; ").lower() in _END:
            return
        if line.strip():
            lines.append(line)
        is_word = len(lines) == 1 and line.lstrip().startswith(".")
        if not is_word and (not lines or (line.strip() and not line.rstrip().endswith(";"))):
            continue
        query = "\n".join(lines)
        lines.clear()
        try:
            if is_word:
                _answer(database, query.strip().rstrip("; "))
            else:
                ask(query)
        except MsgflowError as error:
            print_exception(error)


def _answer(database: Path, line: str) -> None:
    """Answer what the prompts of DuckDB and SQLite have too."""
    word, _, view = line.partition(" ")
    if word not in (".tables", ".schema"):
        print_status(_HELP)
        return
    with Database(database) as opened:
        asked = word == ".schema" and view.strip()
        print_result(opened.schema(asked) if asked else opened.views(), most_rows=None)


def completer(words: Iterable[str]) -> Callable[[str, int], str | None]:
    """Return a function for readline: the n-th word that begins with a text, in any case."""
    known = sorted(words)

    def complete(text: str, number: int) -> str | None:
        fitting = [word for word in known if word.lower().startswith(text.lower())]
        return fitting[number] if number < len(fitting) else None

    return complete
