"""`msgflow fleet query`, `sql`, `worst` and `open`: queries on the runs of a lake."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.options import (
    ColumnsOption,
    FormatOption,
    InternalOption,
    LakeOption,
    LakeWhereOption,
    OutputOption,
    WideOption,
    case_option,
    output_option,
)
from msgflow.cli.row_options import LimitOption, SortOption, row_option
from msgflow.cli.sql import (
    DEFAULT_LIMIT,
    PrintedRowsOption,
    SqlArgument,
    SqlFileOption,
    sql_of,
)
from msgflow.errors import UsageError

_MOST_WORST = 1_000


def query(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="Named query; without it they are listed"),
    ] = None,
    lake: LakeOption = "",
    where: LakeWhereOption = None,
    group_by: Annotated[
        list[str] | None,
        typer.Option(
            "--group-by",
            metavar="LABEL",
            help="One row for each value of this label (or column of run); several between commas",
        ),
    ] = None,
    measure: Annotated[
        str | None,
        typer.Option("--measure", metavar="WHAT", help="What topics measures: see msgflow query"),
    ] = None,
    section: Annotated[
        str | None,
        typer.Option("--section", metavar="WHAT", help="What info lists: findings or quality"),
    ] = None,
    case: Annotated[
        str | None,
        case_option("With e2e-latency: flows that count"),
    ] = None,
    node: Annotated[list[str] | None, row_option("node", "NAME", "Name or glob")] = None,
    topic: Annotated[list[str] | None, row_option("topic", "NAME", "Name or glob")] = None,
    callback: Annotated[list[str] | None, row_option("callback", "NAME", "Name or glob")] = None,
    host: Annotated[list[str] | None, row_option("host", "NAME", "Name or glob")] = None,
    via: Annotated[
        list[str] | None,
        row_option("via", "NAME", "Paths through all of these topics and nodes"),
    ] = None,
    without: Annotated[
        list[str] | None, row_option("without", "NAME", "Paths through none of these")
    ] = None,
    sort: SortOption = None,
    limit: LimitOption = None,
    internal: InternalOption = False,
    form: FormatOption = None,
    columns: ColumnsOption = None,
    output: OutputOption = None,
    wide: WideOption = False,
) -> None:
    """Ask a named query of many runs, as msgflow query asks it of one.

    Quantiles come from the latencies of all flows, or from counts in buckets that are off by less
    than 1 %; they are never averages of those of runs.
    """
    from msgflow.cli.output import print_list, print_result
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.lake_query import fleet_query, header_of, names
    from msgflow.query.selection import values_of
    from msgflow.result.layout import MOST_ROWS

    if name is None:
        listed = [(header_of(each).words, header_of(each).title) for each in names()]
        print_list(listed, ("query", "title"))
        return
    words = {"case": case, "measure": measure, "section": section}
    own = {word: value for word, value in words.items() if value is not None}
    header_of(name, own)
    require_lake(lake)
    result = fleet_query(
        Lake.open(lake),
        name,
        where=where,
        group_by=values_of(group_by),
        internal=internal,
        selection={
            "node": node,
            "topic": topic,
            "callback": callback,
            "host": host,
            "via": via,
            "without": without,
            "sort": sort,
            "limit": limit,
        },
        **own,
    )
    print_result(result, form, output, wide=wide, columns=columns, most_rows=limit or MOST_ROWS)


def sql(
    text: SqlArgument = None,
    lake: LakeOption = "",
    where: LakeWhereOption = None,
    file: SqlFileOption = None,
    limit: PrintedRowsOption = DEFAULT_LIMIT,
    form: FormatOption = None,
    wide: WideOption = False,
    output: OutputOption = None,
) -> None:
    """Run SQL on the tables of a lake, read-only and without access to anything else.

    Tables are run, flow, distribution and the others of docs/fleet.md, with the rows of the chosen
    runs that count; public views are view.publication and so on.
    """
    from msgflow.cli.output import print_result
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.lake_query import fleet_sql

    query = sql_of(text, file, "msgflow fleet sql 'FROM run'")
    require_lake(lake)
    result = fleet_sql(Lake.open(lake), query, where=where, limit=limit or None)
    print_result(result, form, output, wide=wide)


def worst(
    path: Annotated[
        str, typer.Argument(metavar="PATH", help="Text of a path, a glob, or a part: a topic")
    ],
    lake: LakeOption,
    where: LakeWhereOption = None,
    limit: Annotated[
        int,
        typer.Option("--limit", metavar="N", min=1, max=_MOST_WORST, help="Number of flows"),
    ] = 10,
    form: FormatOption = None,
    columns: ColumnsOption = None,
    output: OutputOption = None,
    wide: WideOption = False,
) -> None:
    """Show the flows of a path that took longest, with what opens each."""
    from msgflow.cli.output import print_result
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.lake_query import fleet_worst

    result = fleet_worst(Lake.open(lake), path, where=where, limit=limit)
    print_result(result, form, output, wide=wide, columns=columns, most_rows=limit)


def open_(
    run: Annotated[
        str, typer.Argument(metavar="RUN", help="Key of a run, the begin of it, or a name")
    ],
    lake: LakeOption,
    output: Annotated[
        Path | None,
        output_option(
            help="New database file; one that exists is not replaced",
            show_default="RUN.duckdb",
        ),
    ] = None,
) -> None:
    """Bring one run of a lake back as an ordinary database, for flow, ui and all other commands."""
    from msgflow.cli.output import print_status
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.run_database import open_run

    done = open_run(Lake.open(lake), run, output)
    more = f", upgraded from schema revision {done.before}" if done.before else ""
    print_status(f"run {done.name} ({done.run}) is in {done.path}: {done.size:,} bytes{more}")


def require_lake(lake: str) -> None:
    """Raise an error if no lake is named; some commands do something without one, too."""
    if not lake:
        raise UsageError("no lake is named", "--lake PATH, or MSGFLOW_LAKE")
