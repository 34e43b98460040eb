"""Run SQL on the public views, read-only and without access to other files."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msgflow.backports import Unpack
from msgflow.cli.errors import print_exception
from msgflow.cli.operation import operation
from msgflow.cli.output import Shown, print_result, print_status
from msgflow.database import Database
from msgflow.errors import MsgflowError, UsageError
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.files.text_file import read_text

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult

DEFAULT_LIMIT = 1_000
FileOption = Annotated[Path | None, typer.Option("-f", "--file")]

# Of the prompt: what it completes besides names, what ends it, what it says of itself.
_WORDS = (
    "SELECT",
    "FROM",
    "JOIN",
    "LEFT JOIN",
    "USING",
    "ON",
    "WHERE",
    "GROUP BY",
    "ORDER BY",
    "LIMIT",
    "count(*)",
    "avg(",
    "min(",
    "max(",
    "quantile_disc(",
    "DESCRIBE",
)
_END = ("exit", "quit", ".exit", ".quit", ".q")
_HELP = (
    "a query ends with ; or an empty line; tab completes names; .tables lists the views,"
    " .schema VIEW its columns; Ctrl-D ends"
)


@operation
def command(
    text: str | None = None,
    *,
    file: FileOption = None,
    limit: Annotated[int, typer.Option(min=0)] = DEFAULT_LIMIT,
    database: Path = DEFAULT_DATABASE,
    **shown: Unpack[Shown],
) -> None:
    """`msgflow db schema` lists the views. Without a query, a terminal gets a prompt.

    Args:
        text ([SQL]): A query; - reads it from stdin.
        file: Read the query from FILE.
        limit (ROWS): Maximum number of rows to print; 0 for all.
    """

    def answer(query: str) -> QueryResult:
        # Opened for each: at the prompt, others may write meanwhile.
        with Database(database) as opened:
            return opened.sql(query, limit=limit or None)

    if text is None and file is None and shown.get("output") is None and sys.stdin.isatty():
        prompt(database, lambda query: print_result(answer(query), **shown))
        return
    query = sql_of(text, file, 'msgflow sql "SELECT * FROM run"')
    print_result(answer(query), **shown)


def sql_of(text: str | None, file: Path | None, example: str) -> str:
    """Return the SQL that was given, on the command line, in a file or on stdin."""
    if (text is None) == (file is None):
        raise UsageError("give SQL, or a file with -f", example)
    if file is not None:
        return read_text(file, "cannot read the file", "give a file with SQL with -f")
    return sys.stdin.read() if text == "-" else str(text)


def prompt(database: Path, ask: Callable[[str], None]) -> None:
    """Ask for queries until the user ends it with Ctrl-D, `exit` or `quit`."""
    import readline

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
