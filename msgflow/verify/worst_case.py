"""The worst case of what failed: which flow, call or message it was, and how to look at it."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from msgflow.sql.statement import program

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb

    from msgflow.run.window import Window


@dataclass(frozen=True)
class WorstCase:
    """The worst case.

    Attributes:
        duration_ns: how long it took; None where it did not end.
        at_ns: when it began, epoch ns.
        command: shows it.
    """

    duration_ns: int | None
    at_ns: int
    command: str


# By what a row of the query that measures is known. Duration, begin and identity of its worst case,
# and what that is, come from the statement `worst_…`, of flows from the query's own.
KEYS = {
    "flow": "path",
    "lost_flow": "path",
    "callback": "callback_id",
    "late_call": "callback_id",
    "message": "subscription_id",
    "request": "[service_id, client_id]",
}
FLOWS = {
    "flow": """
SELECT latency_ns, root_ns, take_id, 'take' AS kind
FROM ({}) WHERE path = $subject AND latency_ns IS NOT NULL
ORDER BY latency_ns DESC, root_ns, take_id LIMIT 1
""",
    "lost_flow": """
SELECT NULL::BIGINT AS latency_ns, root_ns, root_id, root_kind
FROM ({}) WHERE path = $subject AND status = 'lost'
ORDER BY root_ns, root_id LIMIT 1
""",
}


def find_worst_case(
    connection: duckdb.DuckDBPyConnection, kind: str, key: Any, window: Window
) -> WorstCase | None:
    """Return the worst case of a kind, None where there is none.

    Args:
        connection: to a database with the public views.
        kind: a key of KEYS that is not of flows.
        key: of the row that failed.
        window: the time window.
    """
    asked = {"key": key, **window.bindings}
    rows = program().run(connection, f"worst_{kind}", asked).fetchall()
    return worst_case_of(rows[0]) if rows else None


def worst_case_of(row: Sequence[Any]) -> WorstCase:
    """Return the worst case that a row of such a statement tells."""
    duration, at_ns, identity, kind = row
    words = ["msgflow", "flow", f"--{kind.replace('_', '-')}", str(identity)]
    return WorstCase(duration, at_ns, shlex.join(words))
