"""The command of one named query, made from its header."""

from __future__ import annotations

import textwrap
from inspect import Parameter
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand, TyperOption

from msgflow.cli.header_options import escape, given_of, header_parameter
from msgflow.cli.options import (
    OUTPUT,
    ColumnsOption,
    DatabaseOption,
    FormatOption,
    InternalOption,
    MemoryLimitOption,
    OutputOption,
    TimesOption,
    WideOption,
)
from msgflow.cli.row_options import row_options
from msgflow.cli.slice_options import SLICE_OPTIONS, set_parameters
from msgflow.errors import UsageError
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.query.catalogue import load_query
from msgflow.query.selection import KINDS
from msgflow.result.layout import MOST_ROWS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from msgflow.result.query_result import QueryResult
    from msgflow.sql.header import Header

# Options of every query, whose names no parameter of a query may have. Via, without and slowest are
# missing: a query with such a parameter chooses its rows before it adds them up.
COMMON_OPTIONS = frozenset(
    (
        *KINDS,
        *SLICE_OPTIONS,
        "path",
        "paths",
        "limit",
        "sort",
        "where",
        "db",
        "format",
        "help",
        "internal",
        "list",
        "memory_limit",
        "output",
        "show",
        "times",
        "columns",
        "wide",
    )
)
# Options that `Database.query` takes under the same names.
_SELECTING = (*KINDS, "via", "without", "path", "paths", "where", "sort", "limit", "slowest")
# Their help stands once, in that of `msgflow query`.
_OF_EVERY_QUERY = frozenset(
    (
        *SLICE_OPTIONS,
        *("internal", "form", "output", "columns", "wide", "times", "show"),
        *("memory_limit", "database", "help"),
    )
)
_ShowOption = Annotated[
    bool,
    typer.Option("--show", help="Print the SQL and run nothing", rich_help_panel=OUTPUT),
]


def refuse_list(name: str | None) -> None:
    """Refuse `--list` beside the name of a query.

    Raises:
        UsageError: always.
    """
    raise UsageError(
        "--list takes no name of a query",
        f"msgflow query --list, or msgflow query {name} --help",
    )


def _refuse_list(context: typer.Context, wanted: bool) -> None:
    if wanted:
        refuse_list(context.info_name)


_ListOption = Annotated[
    bool, typer.Option("--list", hidden=True, is_eager=True, callback=_refuse_list)
]


def build_command(header: Header) -> Any:
    """Return the command that runs the query of `header`."""

    def command(**given: Any) -> None:
        own = given_of(given)
        if given["show"]:
            from msgflow.cli.output import print_lines

            print_lines(header.path.read_text(encoding="utf-8").splitlines())
            return
        _run(header, own, given)

    own_names = {param.name for param in header.params}
    parameters = [header_parameter(param) for param in header.params]
    for name, annotation, default in (
        *(
            (name, annotation, None)
            for name, annotation in row_options(header).items()
            if name not in own_names
        ),
        *((name, annotation, None) for name, annotation in SLICE_OPTIONS.items()),
        ("internal", InternalOption, False),
        ("form", FormatOption, None),
        ("output", OutputOption, None),
        ("columns", ColumnsOption, None),
        ("wide", WideOption, False),
        ("times", TimesOption, None),
        ("show", _ShowOption, False),
        ("list_queries", _ListOption, False),
        ("memory_limit", MemoryLimitOption, None),
        ("database", DatabaseOption, DEFAULT_DATABASE),
    ):
        parameters.append(
            Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        )
    set_parameters(command, parameters)
    single = typer.Typer(
        add_completion=False, context_settings={"help_option_names": ["-h", "--help"]}
    )
    single.command(
        header.words, cls=_command_class(header), help=_help(header), short_help=header.title
    )(command)
    return typer.main.get_command(single)


def _run(header: Header, own: dict[str, Any], given: dict[str, Any]) -> None:
    from msgflow.cli.output import print_result
    from msgflow.export.formats import Format, format_of

    times = given["times"]
    form = given["form"] or format_of(given["output"])
    if times is not None and form in (Format.TABLE, Format.MARKDOWN):
        raise UsageError(
            "tables for people have times with their units — --times",
            "--format csv, json, jsonl or parquet, or a file with such a suffix",
        )
    result = _result(
        header.name,
        given,
        {
            **{name: given[name] for name in SLICE_OPTIONS},
            "internal": given["internal"],
            **{word: given[word] for word in _SELECTING if given.get(word)},
            **own,
        },
    )
    if times is not None:
        result = result.with_times(times)
    print_result(
        result,
        form,
        given["output"],
        wide=given["wide"],
        columns=given["columns"],
        most_rows=given.get("limit") or given.get("slowest") or MOST_ROWS,
    )


def _result(name: str, given: dict[str, Any], asked: dict[str, Any]) -> QueryResult:
    from msgflow.database import Database

    with Database(given["database"], memory_limit=given["memory_limit"]) as database:
        return database.query(name, **asked)


def _command_class(header: Header) -> type[TyperCommand]:
    class QueryCommand(TyperCommand):
        """A command whose help ends with the columns of the result."""

        def format_help(self, ctx: Any, formatter: Any) -> None:
            """Print the help of Typer, without what every query has, then the columns."""
            # Completion still offers the options: they are hidden only here.
            common = [
                param
                for param in self.params
                if isinstance(param, TyperOption) and param.name in _OF_EVERY_QUERY
            ]
            for param in common:
                param.hidden = True
            super().format_help(ctx, formatter)
            _print_columns(header)
            _print_common(common)

    return QueryCommand


def _help(header: Header) -> str:
    grain = f"\n\n{header.grain[:1].upper()}{header.grain[1:]}." if header.grain else ""
    return escape(f"{header.title}.\n\n{header.description}{grain}")


def _print_columns(header: Header) -> None:
    _print_panel(
        "Columns (--show prints all that is said of them)",
        [
            (
                column.name,
                f"[{column.unit}] {column.description}" if column.unit else column.description,
            )
            for column in header.columns
        ],
    )


def _print_common(params: Sequence[TyperOption]) -> None:
    names = ", ".join(param.opts[0] for param in params if param.name != "help")
    text = f"Every query also has {names}: msgflow query --help explains them"
    typer.echo(textwrap.fill(text, 79, initial_indent=" ", subsequent_indent=" "))


def print_options_of_every_query() -> None:
    """Print the options that every query has, with their help."""
    params = build_command(load_query("info")).params
    _print_panel(
        "Options of every query",
        [(", ".join(param.opts), param.help) for param in params if param.name in _OF_EVERY_QUERY],
        is_brief=False,
    )


def _print_panel(title: str, rows: Sequence[tuple[str, str]], *, is_brief: bool = True) -> None:
    """Print names and what they mean in a frame, each in one line if brief."""
    from rich.console import Console
    from rich.panel import Panel
    from rich.table import Table
    from rich.text import Text

    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True, min_width=max(len(name) for name, _ in rows))
    grid.add_column(no_wrap=is_brief, overflow="ellipsis" if is_brief else "fold")
    for name, meaning in rows:
        grid.add_row(Text(name, style="bold cyan"), Text(meaning))
    Console().print(Panel(grid, title=title, title_align="left", border_style="dim"))
