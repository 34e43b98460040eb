"""`msgflow query`: every file of `queries/` is a command with its parameters as options."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from msgflow.cli.query_command import build_command, print_options_of_every_query, refuse_list
from msgflow.query.catalogue import choose_query, load_queries, load_query, query_names

if TYPE_CHECKING:
    from msgflow.sql.header import Param
    from msgflow.sql.value import Value


def _view_names() -> tuple[str, ...]:
    from msgflow.db.objects import public_names

    return public_names()


class QueryGroup(TyperGroup):
    """The named queries as commands; a command gets its options when it runs."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all queries."""
        return list(query_names())

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the help of Typer, then the options that every query has."""
        super().format_help(ctx, formatter)
        print_options_of_every_query()

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command of a query without options; an unknown name is a UsageError."""
        header = load_query(cmd_name, _view_names)
        return TyperCommand(cmd_name, short_help=header.title)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name, the command with the options of the query, and the words behind it."""
        name, found, rest = super().resolve_command(ctx, args)
        chosen = choose_query(str(name), _choice(load_query(str(name)).variant, rest))
        return name, found and build_command(chosen), rest


def _choice(variant: Param | None, words: list[str]) -> dict[str, Value]:
    """Return the value of the option that chooses a variant: the command depends on it."""
    found: dict[str, Value] = {}
    if variant is not None:
        option = f"--{variant.name}"
        for word, following in pairwise([*words, ""]):
            if word == option:
                found[variant.name] = True if variant.type == "BOOLEAN" else following
            elif word.startswith(f"{option}="):
                found[variant.name] = word.removeprefix(f"{option}=")
    return found


app = typer.Typer(cls=QueryGroup, subcommand_metavar="[NAME] [OPTIONS]")


@app.callback(invoke_without_command=True)
def group(
    context: typer.Context,
    list_queries: Annotated[
        bool, typer.Option("--list", help="List the queries, as without a name")
    ] = False,
) -> None:
    """List the queries, unless one is named."""
    if context.invoked_subcommand is not None:
        if list_queries:
            refuse_list(context.invoked_subcommand)
        return
    from msgflow.cli.output import print_list

    print_list([(header.words, header.title) for header in load_queries()], ("query", "title"))
