"""Run a named query; `msgflow query NAME --help` explains it."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from msgflow.cli.output import print_list
from msgflow.cli.query_command import build_command, chosen_by, options_of_every_query
from msgflow.errors import UsageError
from msgflow.query.catalogue import COMMANDS, load_queries, load_query, query_names


def _view_names() -> tuple[str, ...]:
    from msgflow.db.objects import public_names

    return public_names()


class _QueryGroup(TyperGroup):
    """The named queries as commands; a command gets its options when it runs."""

    def list_commands(self, ctx: Any) -> list[str]:
        return [name for name in query_names() if name not in COMMANDS]

    def shared_options(self) -> tuple[str, list[Any]]:
        return "Options of every query", options_of_every_query()

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        header = load_query(cmd_name, _view_names)
        return TyperCommand(cmd_name, short_help=header.title)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name, found, rest = super().resolve_command(ctx, args)
        header = chosen_by(str(name), rest)
        if header.is_command:
            raise UsageError(f"there is no such query — {name}", header.command)
        return name, found and build_command(header), rest


app = typer.Typer(cls=_QueryGroup, subcommand_metavar="[NAME] [OPTIONS]")


@app.callback(invoke_without_command=True)
def group(context: typer.Context) -> None:
    """List the queries, unless one is named."""
    if context.invoked_subcommand is None:
        listed = [(each.words, each.title) for each in load_queries() if not each.is_command]
        print_list(listed, ("query", "title"))
