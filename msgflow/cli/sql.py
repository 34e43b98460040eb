"""`msgflow sql`: any query in SQL, read-only."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Unpack

import typer

from msgflow.cli.operation import operation
from msgflow.cli.output import Shown, print_result
from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.files.text_file import read_text

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult

DEFAULT_LIMIT = 1_000
FileOption = Annotated[Path | None, typer.Option("-f", "--file")]


@operation
def command(
    text: str | None = None,
    *,
    file: FileOption = None,
    limit: Annotated[int, typer.Option(min=0)] = DEFAULT_LIMIT,
    database: Path = DEFAULT_DATABASE,
    **shown: Unpack[Shown],
) -> None:
    """Run SQL on the public views, read-only and without access to other files.

    `msgflow db schema` lists the views. Without a query, a terminal gets a prompt.

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
        from msgflow.cli.sql_prompt import prompt

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
