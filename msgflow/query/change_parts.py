"""What the change of a path consists of: the changes of its parts, by node."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import duckdb

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.result.query_result import QueryResult
from msgflow.run.slice import Slice
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


_ASKED = ("from", "to", "case", "max_depth", "max_paths")


def change_parts(
    connection: duckdb.DuckDBPyConnection,
    compared: QueryResult,
    skipped: float,
    asked: Mapping[str, Any],
    windows: Sequence[str],
) -> QueryResult:
    """Return the parts of the difference of the means of each path, the largest first.

    `skipped` are seconds that were left out at the start of each run, `asked` the parameters of the
    comparison, and `windows` 'START..END' of either side.
    """
    parameters = {name: asked[name] for name in _ASKED}
    with duckdb.connect() as con:
        con.register("compared", compared.table)
        for side, run, window in zip("ab", compared.runs, windows, strict=True):
            start, _, end = window.partition("..")
            part = Slice(run.run_id, start or (str(skipped) if skipped else None), end or None)
            found = run_query(connection, load_query("path-breakdown"), parameters, part)
            con.register(f"part_{side}", found.table)
            values = {"run_id": run.run_id, **part.window([run]).bindings}
            states = internal_sql().run(connection, "callback_state", values)
            con.register(f"state_{side}", states.to_arrow_table())
        table = internal_sql().run(con, "change_part", {}).to_arrow_table()
    header = replace(internal_sql().header("change_part"), name="compare --explain")
    return QueryResult(table, header, compared.runs, compared.notes)
