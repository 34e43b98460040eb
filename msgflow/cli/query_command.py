"""The command of one named query, made from its header."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from inspect import Parameter
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer
from typer.core import TyperCommand

from msgflow.cli.help import lay_out_help
from msgflow.cli.operation import given_of, header_parameter, parameters_of, set_parameters
from msgflow.cli.options import DefaultGroup, one_text
from msgflow.cli.output import print_lines, print_result
from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.export.formats import Format, format_of
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.query.catalogue import choose_query, load_query
from msgflow.query.selection import KINDS, PATH, columns_of
from msgflow.result.layout import MOST_ROWS
from msgflow.result.rows import Times

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult
    from msgflow.sql.header import Header, Param
    from msgflow.sql.value import Value


def _printed(
    *,
    form: Format | None = None,
    output: Path | None = None,
    columns: str | None = None,
    wide: bool = False,
    times: Times | None = None,
    show: bool = False,
    memory_limit: str | None = None,
    database: Path = DEFAULT_DATABASE,
) -> None:
    """Declare the options of a query that are not those of `Database.query`.

    Args:
        show: Print the SQL and run nothing.
    """


_ASKED = list(parameters_of(Database.query, skipped=("self", "name", "parameters")))
_PRINTED = list(parameters_of(_printed))
_DEFAULTS = {each.name: each.default for each in _ASKED}
# Parameters of queries without an option: msgflow flow --take ID --why asks for one flow.
_WITHOUT_OPTION = frozenset(("take",))
# Their help stands once, in that of `msgflow query`.
_OF_EVERY_QUERY = frozenset(
    {"run", "start", "end", "internal", "where", "sort", "limit", "help"}
    | {each.name for each in _PRINTED}
)


def choice_of(variants: Sequence[Param], words: list[str]) -> dict[str, Value]:
    """Return the values of the options that choose a variant: the command depends on it."""
    found: dict[str, Value] = {}
    for variant in variants:
        option = f"--{variant.name}"
        for word, following in pairwise([*words, ""]):
            if word == option:
                found[variant.name] = True if variant.type == "BOOLEAN" else following
            elif word.startswith(f"{option}="):
                found[variant.name] = word.removeprefix(f"{option}=")
    return found


def chosen_by(name: str, words: list[str]) -> Header:
    """Return the query, or the variant of it that the words behind its name choose."""
    return choose_query(name, choice_of(load_query(name).variants, words))


def print_rows(result: QueryResult, form: Any, given: dict[str, Any]) -> None:
    """Write the rows as the options of a query say."""
    most = given.get("limit") or given.get("slowest") or MOST_ROWS
    shown = {word: given[word] for word in ("output", "wide", "columns")}
    print_result(result, form, **shown, most_rows=most)


class AskingGroup(DefaultGroup):
    """A group whose default command asks the query that is called like the group."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands, the default one last."""
        return [*super().list_commands(ctx), self.default]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command; the default one has no options yet."""
        if cmd_name != self.default:
            return super().get_command(ctx, cmd_name)
        return TyperCommand(cmd_name, short_help=load_query(str(self.name)).title)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name, the command with the options of the query, and the words behind it."""
        name, found, rest = super().resolve_command(ctx, args)
        if name == self.default:
            found = build_command(chosen_by(str(self.name), rest), write=self.write)
        return name, found, rest

    def write(self, result: QueryResult, form: Any, given: dict[str, Any]) -> None:
        """Write what the query answers."""
        print_rows(result, form, given)


def build_command(
    header: Header,
    *,
    form: Parameter | None = None,
    form_of: Callable[[Any, Any], Any] = lambda form, path: form or format_of(path),
    write: Callable[[QueryResult, Any, dict[str, Any]], None] = print_rows,
) -> Any:
    """Return the command that runs the query of `header`.

    `form_of` makes a format of the values of `--format` and `-o`.
    """

    def command(**given: Any) -> None:
        own = given_of(given)
        if given["show"]:
            print_lines(header.path.read_text(encoding="utf-8").splitlines())
            return
        form = form_of(given["form"], given["output"])
        times = given["times"]
        for word in () if isinstance(form, Format) else ("times", "columns", "wide"):
            if given[word]:
                raise UsageError(f"--{word} is about rows — {form.value}", "--format table")
        if times is not None and form in (Format.TABLE, Format.MARKDOWN):
            raise UsageError(
                "tables for people have times with their units — --times",
                "--format csv, json, jsonl or parquet, or a file with such a suffix",
            )
        said = {
            word: one_text(given[word])
            for word, default in _DEFAULTS.items()
            if given.get(word, default) not in (default, [])
        }
        with Database(given["database"], memory_limit=given["memory_limit"]) as database:
            result = database.query(header.name, **said, **own)
        write(result if times is None else result.with_times(times), form, given)

    own = {param.name for param in header.params}
    chosen = [_shown_if_useful(each, header) for each in _ASKED if each.name not in own]
    printed = [form if form and each.name == "form" else each for each in _PRINTED]
    declared = (param for param in header.params if param.name not in _WITHOUT_OPTION)
    set_parameters(command, [*map(header_parameter, declared), *chosen, *printed])
    grain = f"\n\n{header.grain[:1].upper()}{header.grain[1:]}." if header.grain else ""
    elsewhere = _OF_EVERY_QUERY - ({form.name} if form else set())
    single = typer.Typer(add_completion=False)
    single.command(
        header.words,
        help=f"{header.title}.\n\n{header.description}{grain}",
        short_help=header.title,
    )(command)
    made = typer.main.get_command(single)
    common = [each for each in made.params if each.name in elsewhere]
    # The meanings of the columns alone would fill a screen.
    made.epilog = (
        f"Columns: {', '.join(column.name for column in header.columns)}; --show explains them\n\n"
        f"Every query also has {', '.join(each.opts[0] for each in common)}:"
        " msgflow query --help explains them"
    )
    return lay_out_help(made, elsewhere)


def _shown_if_useful(parameter: Parameter, header: Header) -> Parameter:
    """Return an option, hidden where the query has nothing to choose: it says so when used."""
    kind, info = get_args(parameter.annotation)
    info = copy(info)
    info.hidden = not _is_useful(parameter.name, header)
    return parameter.replace(annotation=Annotated[kind, info])


def _is_useful(name: str, header: Header) -> bool:
    if name in KINDS:
        return bool(columns_of(header, name))
    if name in ("via", "without"):
        return bool(columns_of(header, PATH))
    if name in ("path", "paths"):
        return any(param.name == "from" for param in header.params)
    return name != "slowest" or header.slowest is not None


def options_of_every_query() -> list[Any]:
    """Return the options that every query has."""
    command = build_command(load_query("topics"))
    return [each for each in command.params if each.name in _OF_EVERY_QUERY]
