"""The worst case of what failed: which flow, call or message it was, and how to look at it."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb


@dataclass(frozen=True)
class Worst:
    """The worst case.

    Attributes:
        duration_ns: how long it took; None where it did not end.
        at_ns: when it began, epoch ns.
        command: shows it.
    """

    duration_ns: int | None
    at_ns: int
    command: str


# By what a row of the query that measures is known, and SQL that gives duration, begin and identity
# of its worst case, with what that is.
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
_SQL = {
    "callback": """
SELECT end_ns - start_ns AS worst_ns, start_ns, callback_instance_id, 'callback_instance'
FROM main.callback_instance
WHERE callback_id = $key AND end_ns IS NOT NULL AND start_ns >= $start_ns AND start_ns < $end_ns
ORDER BY worst_ns DESC, start_ns, callback_instance_id LIMIT 1
""",
    "late_call": """
SELECT wait_ns, start_ns, callback_instance_id, 'callback_instance'
FROM main.executor_wait
WHERE callback_id = $key AND since = 'timer' AND NOT is_loss_affected
    AND start_ns >= $start_ns AND start_ns < $end_ns
ORDER BY wait_ns DESC, start_ns, callback_instance_id LIMIT 1
""",
    "message": """
SELECT l.latency_ns, t.taken_ns, t.take_id, 'take'
FROM main.link_transport AS l
JOIN main.take AS t ON l.take_id = t.take_id
WHERE t.subscription_id = $key AND t.taken_ns >= $start_ns AND t.taken_ns < $end_ns
ORDER BY l.latency_ns DESC, t.taken_ns, t.take_id LIMIT 1
""",
    "request": """
SELECT p.taken_ns - q.sent_ns AS worst_ns, q.sent_ns, q.request_id, 'request'
FROM main.request AS q
JOIN main.response AS p ON q.request_id = p.request_id
WHERE [q.service_id, q.client_id] = $key AND q.sent_ns >= $start_ns AND q.sent_ns < $end_ns
    AND p.taken_ns IS NOT NULL
ORDER BY worst_ns DESC, q.sent_ns, q.request_id LIMIT 1
""",
}


def find_worst(
    connection: duckdb.DuckDBPyConnection, kind: str, key: Any, window: tuple[int, int]
) -> Worst | None:
    """Return the worst case of a kind, None where there is none.

    Args:
        connection: to a database with the public views.
        kind: a key of KEYS that is not of flows.
        key: of the row that failed.
        window: begin and end, epoch ns.
    """
    row = connection.execute(
        _SQL[kind], {"key": key, "start_ns": window[0], "end_ns": window[1]}
    ).fetchone()
    return None if row is None else worst_of(row)


def worst_of(row: Sequence[Any]) -> Worst:
    """Return the worst case that a row of the SQL above tells."""
    duration, at_ns, identity, kind = row
    words = ["msgflow", "flow", f"--{kind.replace('_', '-')}", str(identity)]
    return Worst(duration, at_ns, shlex.join(words))
