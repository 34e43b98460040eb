"""The commands that headers name as `next` are there, with their options, and have their values."""

from __future__ import annotations

import re
from collections.abc import Sequence

import typer
from support.each import each
from support.sql_files import SqlFile, sql_files

from msgflow.cli.app import app
from msgflow.db.store_table import store_tables
from msgflow.query.catalogue import load_query
from msgflow.sql.statement import internal_sql

FILES = [file for file in sql_files() if file.header.next]


def parse(words: Sequence[str]) -> None:
    """Parse a command line as the program does, without running the command."""
    command, rest = typer.main.get_command(app), list(words)
    context = command.context_class(command)
    while hasattr(command, "resolve_command") and rest:
        name, command, rest = command.resolve_command(context, rest)
        context = command.context_class(command, parent=context, info_name=name)
    command.parse_args(context, rest)
    for param in load_query(words[1]).params if words[0] == "query" else ():
        value = context.params.get(param.name)
        assert value is None or not param.choices or value in param.choices, value


@each(FILES)
def test_the_next_command_is_one_of_the_program(file: SqlFile) -> None:
    for words in file.header.next:
        parse([re.sub(r"\{[a-z_]+\}", "1", word) for word in words])


@each(FILES)
def test_the_next_command_names_columns_of_the_row(file: SqlFile) -> None:
    """A finding is stored, so its row has the columns of the table; a culprit is in the verdict."""
    known = {column.name for column in file.header.columns}
    if file.layer == "health":
        known |= store_tables()["finding"].columns.keys()
    elif file.layer == "culprit":
        known |= {column.name for column in internal_sql().header("verdict").columns}
    named = {name for words in file.header.next for name in re.findall(r"\{(\w+)\}", str(words))}
    assert named <= known
