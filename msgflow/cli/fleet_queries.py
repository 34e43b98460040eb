"""`msgflow fleet query`, `sql`, `worst` and `open`: queries on the runs of a lake."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.operation import operation
from msgflow.cli.options import one_text
from msgflow.cli.output import print_list, print_result, print_status
from msgflow.cli.sql import DEFAULT_LIMIT, FileOption, sql_of
from msgflow.errors import UsageError
from msgflow.export.formats import Format
from msgflow.result.layout import MOST_ROWS

_MOST_WORST = 1_000


@operation
def query(
    name: str | None = None,
    *,
    lake: str = "",
    where: str | None = None,
    group_by: list[str] | None = None,
    measure: str | None = None,
    section: str | None = None,
    case: str | None = None,
    node: list[str] | None = None,
    topic: list[str] | None = None,
    callback: list[str] | None = None,
    host: list[str] | None = None,
    via: list[str] | None = None,
    without: list[str] | None = None,
    sort: list[str] | None = None,
    limit: int | None = None,
    internal: bool = False,
    form: Format | None = None,
    columns: str | None = None,
    output: Path | None = None,
    wide: bool = False,
) -> None:
    """Ask a named query of many runs, as msgflow query asks it of one.

    Quantiles come from the latencies of all flows, or from counts in buckets that are off by less
    than 1 %; they are never averages of those of runs.

    Args:
        name ([NAME]): Named query; without it they are listed.
        group_by (LABEL): One row for each value of this label (or column of run); several between
            commas.
        measure (WHAT): What topics measures: see msgflow query.
        section (WHAT): What info lists: findings or quality.
        case: With e2e-latency: flows that count: first or last arrival of each root, newest root of
            each arrival, or all.
    """
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.lake_query import fleet_query, header_of, names
    from msgflow.query.selection import values_of

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
        group_by=values_of(one_text(group_by)),
        internal=internal,
        selection={
            "node": one_text(node),
            "topic": one_text(topic),
            "callback": one_text(callback),
            "host": one_text(host),
            "via": one_text(via),
            "without": one_text(without),
            "sort": one_text(sort),
            "limit": limit,
        },
        **own,
    )
    print_result(result, form, output, wide=wide, columns=columns, most_rows=limit or MOST_ROWS)


@operation
def sql(
    text: str | None = None,
    *,
    lake: str = "",
    where: str | None = None,
    file: FileOption = None,
    limit: Annotated[int, typer.Option(min=0)] = DEFAULT_LIMIT,
    form: Format | None = None,
    wide: bool = False,
    output: Path | None = None,
) -> None:
    """Run SQL on the tables of a lake, read-only and without access to anything else.

    Tables are run, flow, distribution and the others of docs/fleet.md, with the rows of the chosen
    runs that count; public views are view.publication and so on.

    Args:
        text ([SQL]): A query; - reads it from stdin.
        file: Read the query from FILE.
        limit (ROWS): Maximum number of rows to print; 0 for all.
    """
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.lake_query import fleet_sql

    query = sql_of(text, file, "msgflow fleet sql 'FROM run'")
    require_lake(lake)
    result = fleet_sql(Lake.open(lake), query, where=where, limit=limit or None)
    print_result(result, form, output, wide=wide)


@operation
def worst(
    path: Annotated[str, typer.Argument()],
    *,
    lake: str,
    where: str | None = None,
    limit: Annotated[int, typer.Option(min=1, max=_MOST_WORST)] = 10,
    form: Format | None = None,
    columns: str | None = None,
    output: Path | None = None,
    wide: bool = False,
) -> None:
    """Show the flows of a path that took longest, with what opens each.

    Args:
        path (PATH): Text of a path, a glob, or a part: a topic.
        limit (N): Number of flows.
    """
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.lake_query import fleet_worst

    result = fleet_worst(Lake.open(lake), path, where=where, limit=limit)
    print_result(result, form, output, wide=wide, columns=columns, most_rows=limit)


@operation
def open_(run: Annotated[str, typer.Argument()], *, lake: str, output: Path | None = None) -> None:
    """Bring one run of a lake back as an ordinary database, for flow, ui and all other commands.

    Args:
        run (RUN): Key of a run, the begin of it, or a name.
        output: New database file; one that exists is not replaced. By default RUN.duckdb.
    """
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.run_database import open_run

    done = open_run(Lake.open(lake), run, output)
    more = f", upgraded from schema revision {done.before}" if done.before else ""
    print_status(f"run {done.name} ({done.run}) is in {done.path}: {done.size:,} bytes{more}")


def require_lake(lake: str) -> None:
    """Raise an error if no lake is named; some commands do something without one, too."""
    if not lake:
        raise UsageError("no lake is named", "--lake PATH, or MSGFLOW_LAKE")
