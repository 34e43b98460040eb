"""Which functions the callback spends its CPU time in that takes most of a late path's time."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    import duckdb

    from msgflow.query.why import Explanation
    from msgflow.run.slice import Slice

_SAMPLED = "SELECT 1 FROM main.stack_sample WHERE run_id = ? LIMIT 1"


def with_functions(
    connection: duckdb.DuckDBPyConnection, found: Explanation, times: Slice
) -> Explanation:
    """Add a sentence with the three functions, where functions were sampled."""
    parts = found.nodes.table.to_pylist()
    slowest = next((row for row in parts if row["part"] == "callback"), None)
    run_id = found.run.run_id
    if slowest is None or not connection.execute(_SAMPLED, [run_id]).fetchall():
        return found
    asked = {"run_id": run_id, "node": slowest["node"], "callback": slowest["what"]}
    asked |= replace(times, start=found.start).window([found.run]).bindings
    rows = internal_sql().run(connection, "callback_function", asked).fetchall()
    if not rows:
        return found
    shares = ", ".join(f"{function} {100 * share:.0f} %" for function, share, _ in rows)
    said = f"CPU time of {slowest['node']} {slowest['what']}: {shares} (of {rows[0][2]:,} samples)"
    step = ["query", "functions", "--node", slowest["node"], "--callback", slowest["what"]]
    if times.start is None and found.start is not None:
        step += ["--start", str(found.start)]
    return replace(found, notes=(*found.notes, said), steps=(*found.steps, tuple(step)))
