"""Worst case of a failed requirement: the flow, call, message or goal, and how to see it."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.window import Window

LOST_FLOW = """
SELECT NULL::BIGINT AS latency_ns, root_ns, root_id, root_kind
FROM ({}) WHERE path = $subject AND status IN ('dropped', 'lost')
ORDER BY root_ns, root_id LIMIT 1
"""


def find_worst_case(
    connection: duckdb.DuckDBPyConnection, kind: str, key: Any, window: Window
) -> dict[str, Any]:
    """Return the worst case of a kind; nothing if nothing was measured."""
    asked = {"key": key, **window.bindings}
    rows = internal_sql().run(connection, f"worst_{kind}", asked).fetchall()
    return worst_case_of(rows[0]) if rows else {}


def worst_case_of(row: Sequence[Any]) -> dict[str, Any]:
    """Return columns of a verdict: the worst case in a row of such a statement."""
    duration, at_ns, identity, kind = row
    words = ["msgflow", "flow", f"--{kind.replace('_', '-')}", str(identity)]
    return {"worst_ns": duration, "worst_at_ns": at_ns, "see": shlex.join(words)}
