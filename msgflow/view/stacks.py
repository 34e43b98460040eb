"""Stacks of flame graphs: of a run, or of the slowest flows of a path beside the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.query.catalogue import load_query
from msgflow.query.runner import Steps, bind
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb
    import pyarrow as pa

    from msgflow.run.choice import Run
    from msgflow.run.window import Window


def stacks(
    connection: duckdb.DuckDBPyConnection,
    run: Run,
    window: Window,
    instances: Sequence[int] | None = None,
) -> pa.Table:
    """Return stacks of callback instances, else of the window; those with most samples first."""
    values = {"run_id": run.run_id, "instances": instances, **window.bindings}
    table = internal_sql().run(connection, "folded_stack", values).to_arrow_table()
    return table.sort_by([("samples", "descending"), ("stack", "ascending")])


def stacks_of_path(
    connection: duckdb.DuckDBPyConnection,
    run: Run,
    window: Window,
    path: str,
    slowest: int,
) -> tuple[pa.Table, pa.Table]:
    """Return stacks on the way of so many slowest flows of a path, and of its other flows."""
    header = load_query("functions")
    chosen = bind(header, {"via": [path]})
    with Steps(connection) as steps:
        steps.make(header, {"runs": [run.run_id], **chosen, **window.bindings})
        found = connection.table("function_instance").fetchall()
    slow = [instance for instance, place in found if place <= slowest]
    others = [instance for instance, place in found if place > slowest]
    return stacks(connection, run, window, slow), stacks(connection, run, window, others)
