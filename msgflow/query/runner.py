"""Runner of named queries: it chooses runs and times, binds parameters, and hides internal rows."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import duckdb

from msgflow.backports import Self
from msgflow.errors import UsageError
from msgflow.query.names import PLACE_PARAMETERS, require_ids, require_names, require_places
from msgflow.query.notes import empty_notes, outside, row_notes
from msgflow.query.selection import (
    COUNTS,
    CUT_COLUMN,
    INTERNAL_COLUMN,
    PLACE,
    Selection,
    selected,
    sorted_by,
)
from msgflow.result.query_result import QueryResult
from msgflow.run.slice import LATEST, Slice
from msgflow.sql.failure import first_line, query_errors
from msgflow.sql.statement import internal_sql, may_have_rows, recorded
from msgflow.sql.value import described_type, parse_text
from msgflow.text.name_suggestions import did_you_mean

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.run.choice import Run
    from msgflow.sql.header import Header, Param
    from msgflow.sql.statement import Statements
    from msgflow.sql.value import Value

_COLUMN = re.compile(r'Referenced column "([^"]*)"')
# Errors that a user's condition may cause: the queries themselves are tested.
_OF_CONDITIONS = (duckdb.ProgrammingError, duckdb.DataError, duckdb.PermissionException)


class Steps:
    """The tables of the steps of queries: those that several queries share are made once.

    Two queries share a table if the same statement makes it, with the same values. The tables are
    dropped at the end of the `with` block. `known` has a statement of the name of each step whose
    rows cost less, from tables that are there by then.
    """

    def __init__(
        self, connection: duckdb.DuckDBPyConnection, known: Statements | None = None
    ) -> None:
        self._connection = connection
        self._known = known
        self._made: dict[str, tuple[str, dict[str, Any]]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        for table in self._made:
            # An interrupt of the query may interrupt this, too; the next query replaces the table.
            with contextlib.suppress(duckdb.Error):
                self._connection.execute(f"DROP TABLE IF EXISTS temp.{table}")

    def __contains__(self, table: str) -> bool:
        """Whether a table was made."""
        return table in self._made

    @cached_property
    def recorded(self) -> Mapping[str, bool]:
        """What the recordings of the database have, by the names in `RECORDED`."""
        return recorded(self._connection)

    def make(self, header: Header, values: Mapping[str, Any]) -> None:
        """Make the tables of a query that are not there yet, for these values of its parameters."""
        for step in header.steps:
            names = self._connection.extract_statements(step.sql)[0].named_parameters
            wanted = step.sql, {name: values[name] for name in names}
            if self._made.get(step.table) == wanted:
                continue
            if step.table in self._made:
                # What was made of the old rows has to be made again: that stands behind it.
                made = list(self._made)
                self._made |= dict.fromkeys(made[made.index(step.table) :], ("", {}))
            self._made[step.table] = "", {}
            if self._known is not None and step.table in self._known.names():
                self._known.keep(self._connection, step.table, values)
            elif may_have_rows(self._connection, step.sources, values):
                self._connection.execute(*wanted)
            else:
                self._connection.execute(
                    f"CREATE OR REPLACE TEMP TABLE {step.table} ({step.columns})"
                )
            self._made[step.table] = wanted

    def answer(self, sql: str, values: Mapping[str, Any]) -> pa.Table:
        """Return the rows of a query. DuckDB would look twice at the SQL of a relation."""
        self._made["answer"] = "", {}
        self._connection.execute(f"CREATE OR REPLACE TEMP TABLE answer AS {sql}", values)
        return self._connection.sql("FROM temp.answer").to_arrow_table()

    def keep(self, name: str, values: Mapping[str, Any]) -> None:
        """Make a table of the rows of a statement of `schema/internal`, which has its name."""
        self._made[name] = "", {}
        internal_sql().keep(self._connection, name, values)

    def unite(self, table: str, statements: Statements, values: Mapping[str, Any]) -> None:
        """Make a table of the rows of all statements of a folder."""
        self._made[table] = "", {}
        statements.unite(self._connection, table, values)


def run_query(
    connection: duckdb.DuckDBPyConnection,
    header: Header,
    parameters: Mapping[str, Value],
    part: Slice = LATEST,
    *,
    internal: bool = False,
    selection: Selection | None = None,
    steps: Steps | None = None,
    runs: tuple[Run, ...] | None = None,
    is_known: bool = False,
) -> QueryResult:
    """Run the query of `header` with its own parameters; text is read as the declared type.

    `steps` are tables that it shares with other queries, which stay; `runs` are those of `part`,
    where they are known. `is_known` says that the places among the parameters are of these runs. A
    UsageError is about what the user gave, a QueryError about the rest.
    """
    if part.has_window and not header.has_window:
        raise UsageError(
            f"the query has no time window — {header.words}", "leave out --start and --end"
        )
    runs = part.runs(connection) if runs is None else runs
    window = part.window(runs)
    reserved: dict[str, Value] = {"runs": [run.run_id for run in runs], **window.bindings}
    own = bind(header, parameters)
    own |= require_places(connection, runs, own, is_known=is_known)
    require_ids(connection, runs, own)
    selection = selection or Selection()
    sql, chosen = selected(header, selection, internal)
    for kind, names in selection.names().items():
        require_names(connection, runs, kind, names)
    values = reserved | own
    used = connection.extract_statements(header.body)[0].named_parameters
    with (
        query_errors(header.words, f"the query failed: {{}} — {header.words}"),
        contextlib.nullcontext(steps) if steps is not None else Steps(connection) as tables,
    ):
        if any("$has_" in text for text in header.statements):
            values |= tables.recorded
        tables.make(header, values)
        bindings = {name: values[name] for name in used} | chosen
        try:
            table = tables.answer(sql, bindings)
        except _OF_CONDITIONS as error:
            if selection.where is None:
                raise
            known = [column.name for column in header.columns]
            unknown = _COLUMN.search(str(error))
            raise UsageError(
                f"--where cannot be evaluated: {first_line(error)}",
                did_you_mean(
                    unknown[1] if unknown else "", known, f"the columns are {', '.join(known)}"
                ),
            ) from error
    table, missing, has_rows = shown_rows(table, internal=internal)
    notes = [] if runs else ["the database holds no run yet"]
    if part.has_window:
        notes += outside(runs, window)
    notes += missing
    if runs and not has_rows:
        notes += empty_notes(connection, runs, header.note, own, selection)
    notes += row_notes(connection, runs, header.note, table)
    return QueryResult(table, header, runs, notes, order=sorted_by(header, selection))


def bind(
    header: Header, given: Mapping[str, Value], command: str | None = None
) -> dict[str, Value]:
    """Return the value of every parameter of `header`.

    A given name may end with an underscore, as Python reserves some names (`from_`). `command` is
    the one that has the parameters as options, `msgflow query NAME` when None.
    """
    called = header.words if command is None else command
    command = command or header.command
    names = [param.name for param in header.params]
    by_name: dict[str, Value] = {}
    for name, value in given.items():
        exact = name if name in names else name.removesuffix("_")
        if exact not in names:
            known = f"its parameters are {', '.join(names)}" if names else "it has none"
            raise UsageError(f"{called} has no such parameter — {name}", known)
        by_name[exact] = value
    bound: dict[str, Value] = {}
    for param in header.params:
        if param.name in by_name:
            bound[param.name] = _checked(command, param, by_name[param.name])
        elif param.has_default:
            bound[param.name] = param.default
        else:
            raise UsageError(
                f"{called} needs a value for a parameter — {param.name}",
                f"{command} --{param.name.replace('_', '-')} {param.type}",
            )
    return bound


def _checked(command: str, param: Param, value: Value) -> Value:
    option = f"--{param.name.replace('_', '-')}"
    if param.name in PLACE_PARAMETERS and isinstance(value, list | tuple):
        value = [str(each) for each in value] or None
    if isinstance(value, str):
        try:
            value = parse_text(value, param.type)
        except ValueError:
            raise UsageError(
                f"{option} takes {described_type(param.type)} — {value}", f"{command} --help"
            ) from None
    if param.choices and value is not None and value not in param.choices:
        raise UsageError(
            f"{option} has no such value — {value}",
            did_you_mean(str(value), param.choices, f"choose {' or '.join(param.choices)}"),
        )
    if param.minimum is not None and isinstance(value, int) and value < param.minimum:
        raise UsageError(
            f"{option} is at least {param.minimum} — {value}", f"{command} {option} {param.minimum}"
        )
    return value


def shown_rows(table: pa.Table, *, internal: bool) -> tuple[pa.Table, list[str], bool]:
    """Return the rows to show, notes on those that are missing, and whether there are any."""
    total, hidden, cut = (table[name][0].as_py() for name in COUNTS)
    if table[PLACE][0].as_py() is None:
        table = table.slice(0, 0)
    table = table.drop_columns([*COUNTS, PLACE])
    if not internal and INTERNAL_COLUMN in table.column_names:
        table = table.drop_columns([INTERNAL_COLUMN])
    notes = []
    if table.num_rows < total:
        notes.append(f"{table.num_rows:,} of {total:,} rows")
    if hidden:
        rows = "1 internal row is" if hidden == 1 else f"{hidden:,} internal rows are"
        notes.append(f"{rows} hidden; --internal shows them")
    if cut:
        notes.append(f"{cut} of the rows are cut off by the limits of the query, see {CUT_COLUMN}")
    return table, notes, bool(total or hidden)
