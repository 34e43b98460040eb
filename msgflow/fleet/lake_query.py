"""Queries over many runs of a lake: named ones, the slowest flows of a path, and SQL of users.

Each named query has a statement below `sql` that combines runs. It adds up counts and sums,
compares extremes, and takes quantiles from rows of flows or from counts in buckets. Quantiles are
never averaged.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa

from msgflow.database import guarded_rows, sql_error
from msgflow.db.sandbox import open_memory
from msgflow.errors import DatabaseError, QueryError, UsageError
from msgflow.fleet.lake import Lake
from msgflow.fleet.lake_connection import (
    VIEWS,
    Choice,
    Reading,
    choose,
    lake_errors,
    what_there_is,
)
from msgflow.fleet.part import ANSWERS
from msgflow.query.catalogue import choose_query, load_query, queries_meant
from msgflow.query.runner import bind, shown_rows
from msgflow.query.selection import make_selection, selected, values_of
from msgflow.result.query_result import QueryResult
from msgflow.sql.failure import first_line
from msgflow.sql.header import Column, Header, relations_of
from msgflow.sql.interrupt import interruptible
from msgflow.sql.quoting import identifier
from msgflow.sql.statement import Statements, registered
from msgflow.sql.value import Value
from msgflow.text.name_suggestions import did_you_mean

GROUP = "label_group"
WORST = "worst"
DEFAULT_LIMIT = 10
# Words of SQL that look at tables without naming them, and those that name public views.
_LISTS = re.compile(r"\b(show|information_schema|duckdb_\w+)\b", re.IGNORECASE)
_OF_VIEWS = re.compile(rf"\b{VIEWS}\W+(\w+)", re.IGNORECASE)
# What DuckDB says where files lack a column, that of a statement or one among its COLUMNS.
_LACKING = re.compile(r'(?:does not have a column named|Column) "(\w+)"')
_BUCKETS = "distributed"
STATEMENTS = Statements(Path(__file__).parent / "sql")


@cache
def names() -> tuple[str, ...]:
    """Return the names of the queries that a lake answers, sorted."""
    return tuple(
        name.replace("_", "-")
        for name in STATEMENTS.names()
        if any(column.name == GROUP for column in STATEMENTS.header(name).columns)
    )


def header_of(name: str, given: Mapping[str, Value] | None = None) -> Header:
    """Return the header of a query that a lake answers."""
    given = given or {}
    try:
        query = choose_query(name, given)
    except UsageError:
        known, meant = _words(), queries_meant(name)
        there = [f"msgflow fleet query {each.words}" for each in meant if each.name in names()]
        hint = did_you_mean(name, known, f"a lake answers {', '.join(known)}")
        if meant:
            hint = " or ".join(there) or f"msgflow fleet open RUN, then {meant[0].command}"
        raise UsageError(f"there is no such query — {name}", hint) from None
    variants = query.variants
    chosen = {each.name: given[each.name] for each in variants if each.name in given}
    bind(replace(query, params=variants), chosen, f"msgflow fleet query {name}")
    if query.name not in names():
        raise UsageError(
            f"a lake does not hold what this query needs — {query.words}",
            f"it answers {', '.join(_words())}; for others: msgflow fleet open RUN, then"
            f" {query.command}",
        )
    header = STATEMENTS.header(query.name.replace("-", "_"))
    return replace(
        header, chosen=query.words, params=(*variants, *header.params), variants=variants
    )


def _words() -> list[str]:
    return [load_query(each).words for each in names()]


def fleet_query(
    lake: Lake,
    name: str,
    *,
    where: str | None = None,
    group_by: Sequence[str] = (),
    internal: bool = False,
    selection: Mapping[str, object] | None = None,
    **parameters: Value,
) -> QueryResult:
    """Ask a named query of many runs."""
    header = header_of(name, parameters)
    own = bind(header, parameters, f"msgflow fleet query {header.words}")
    for variant in header.variants:
        # It has chosen the statement, which does not take it.
        del own[variant.name]
    chosen = make_selection(dict(selection or {}), lake_names)
    choice = choose(lake, where)
    grouped, groups = _grouped(choice, header, group_by)
    with Reading(choice, _tables(header), groups=groups) as reading:
        con = reading.connection
        sql, bindings = selected(grouped, chosen, internal)
        table = _asked(lake, name, con, lambda: con.sql(sql, params=own | bindings))
    table, missing, _ = shown_rows(table, internal=internal)
    notes = []
    if len(choice.runs) < choice.total:
        notes.append(f"{len(choice.runs):,} of {choice.total:,} runs")
    notes += missing
    is_each_alone = len(choice.runs) == 1 or "run" in group_by
    if _BUCKETS in header.relations and not is_each_alone:
        notes.append("medians and other quantiles of several runs are off by less than 1 %")
    return QueryResult(table, grouped, notes=notes)


def lake_names(kind: str, text: str) -> Sequence[str]:
    """Return what a text may name: a name with commas in some run, or several without."""
    parts = values_of(text)
    # A path goes through all of several places.
    return parts if kind == "place" or parts == (text,) else (text, *parts)


def fleet_sql(
    lake: Lake, text: str, *, where: str | None = None, limit: int | None = None
) -> QueryResult:
    """Run SQL that only reads on the tables of a lake."""
    choice = choose(lake, where)
    try:
        words = set(re.findall(r"\w+", text.lower()))
        tables = ANSWERS if _LISTS.search(text) else [name for name in ANSWERS if name in words]
        with Reading(choice, tables, _OF_VIEWS.findall(text.lower())) as reading:
            con = reading.connection
            with lake_errors(lake, is_query=True):
                return guarded_rows(con, text, "msgflow fleet sql 'FROM run'", limit)
    except duckdb.Error as error:
        said = sql_error(error, "ask about fewer runs with --where")
        has_database = any(choice.runs["database_part"].to_pylist())
        if isinstance(error, duckdb.CatalogException) and not has_database:
            said.hint = "these runs have no views: --no-database left out their databases"
        raise said from error


def fleet_worst(
    lake: Lake, path: str, *, where: str | None = None, limit: int = DEFAULT_LIMIT
) -> QueryResult:
    """Return the slowest flows of a path, each with the command that opens it."""
    header = STATEMENTS.header(WORST)
    choice = choose(lake, where)
    with Reading(choice, _tables(header)) as reading:
        con = reading.connection
        values = {"path": path, "count": limit}
        table = _asked(lake, WORST, con, lambda: STATEMENTS.run(con, WORST, values))
    if not len(table):
        raise UsageError(
            f"no flow of these runs reached the end of a path with this text — {path}",
            f"msgflow fleet query e2e-latency --lake {shlex.quote(lake.store.url)}",
        )
    databases = dict(
        zip(choice.runs["run"].to_pylist(), choice.runs["database_part"].to_pylist(), strict=True)
    )
    # SQL does not know the commands of a shell; these are few rows.
    commands = [_command(lake, row) if databases[row["run"]] else None for row in table.to_pylist()]
    table = table.append_column("command", pa.array(commands, pa.string()))
    notes = []
    if commands[0] is not None:
        # The screen may have no room for the column.
        notes.append(f"the slowest one: {commands[0]}")
    if None in commands:
        notes.append("runs without a command were written with --no-database")
    meaning = Column("command", "VARCHAR", None, "What opens the flow")
    return QueryResult(table, replace(header, columns=(*header.columns, meaning)), notes=notes)


def _command(lake: Lake, row: Mapping[str, Any]) -> str:
    option = f"--{row['root_kind'].replace('_', '-')}"
    opening = ["msgflow", "fleet", "open", row["run"], "--lake", lake.store.url]
    flow = ["msgflow", "flow", "--db", f"{row['run']}.duckdb", option, str(row["root_id"])]
    return f"{shlex.join(opening)} && {shlex.join(flow)}"


def _tables(header: Header) -> list[str]:
    read = relations_of(STATEMENTS.text(header.name))
    return sorted(read.intersection(ANSWERS))


def _grouped(choice: Choice, header: Header, group_by: Sequence[str]) -> tuple[Header, pa.Table]:
    """Return a query with the labels of groups, and the group of each run: a list of labels."""
    taken = {column.name.lower() for column in header.columns}
    fields = set(choice.runs.column_names) - {"labels"}
    values, bound = [], {}
    columns: list[Column] = []
    for name in dict.fromkeys(group_by):
        if name in fields:
            values.append(identifier(name))
        elif name in choice.labels:
            bound[f"key_{len(values)}"] = name
            values.append(f"labels[$key_{len(values)}]")
        else:
            raise UsageError(
                f"no run of the lake has such a label — {name}",
                what_there_is(name, choice.labels, sorted(fields)),
            )
        title = f"label_{name}" if name.lower() in taken else name
        columns.append(Column(title, "VARCHAR", None, f"Value of {name}"))
    group = f"SELECT run, [{', '.join(values)}]::VARCHAR[] AS {GROUP} FROM known_run"
    with open_memory() as con, registered(con, known_run=choice.runs):
        groups = con.sql(group, params=bound).to_arrow_table()
    listed = "".join(
        f"{GROUP}[{place}] AS {identifier(column.name)}, "
        for place, column in enumerate(columns, 1)
    )
    text = STATEMENTS.text(header.name).rstrip().rstrip(";")
    body = f"SELECT {listed}* EXCLUDE ({GROUP}) FROM (\n{text}\n)"
    kept = (column for column in header.columns if column.name != GROUP)
    first = (column.name for column in columns)
    brief = (*header.brief[:1], *first, *header.brief[1:])
    return replace(header, columns=(*columns, *kept), body=body, brief=brief), groups


def _asked(
    lake: Lake,
    name: str,
    con: duckdb.DuckDBPyConnection,
    ask: Callable[[], duckdb.DuckDBPyRelation],
) -> pa.Table:
    try:
        with lake_errors(lake, is_query=True):
            return interruptible(con, lambda: ask().to_arrow_table(), only_reads=True)
    except duckdb.Error as error:
        lacking = _LACKING.search(str(error))
        if lacking is not None and name in names():
            raise DatabaseError(
                f"the lake lacks what {name} needs ({lacking[1]}): an earlier msgflow wrote it"
                f" — {lake.store.url}",
                "ingest the recordings into a new lake: msgflow fleet ingest SOURCE --lake LAKE",
            ) from error
        raise QueryError(f"the query failed: {first_line(error)} — {name}") from error
