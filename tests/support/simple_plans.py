"""Plans for a few rows: any of them is as good as the best, and to look for that takes longer."""

from __future__ import annotations

import duckdb

# Without these, some statements cannot be planned, or take far longer than with them.
_KEPT = (
    "expression_rewriter",
    "filter_pushdown",
    "cte_filter_pusher",
    "in_clause",
    "deliminator",
    "unnest_rewriter",
    "unused_columns",
    "column_lifetime",
    "materialized_cte",
    "cte_inlining",
)


def plan_simply(connection: duckdb.DuckDBPyConnection) -> None:
    """Have a connection plan with few optimizers, and run what it plans in one thread."""
    connection.execute("SET threads = 1")
    names = connection.execute("SELECT name FROM duckdb_optimizers()").fetchall()
    left_out = ",".join(name for (name,) in names if name not in _KEPT)
    connection.execute("SET disabled_optimizers = ?", [left_out])
