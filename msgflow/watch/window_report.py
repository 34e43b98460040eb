"""What a window shows: rows of the named queries, as `msgflow query` prints them."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow.text.json_value import json_value

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import duckdb

    from msgflow.run.window import Window

Row = dict[str, Any]

_PATH = (
    "path", "roots", "reached", "superseded", "dropped", "lost", "no_output", "not_connected",
    "unknown", "cut_by_recording", "loss_affected", "median_ns", "p99_ns", "max_ns", "reasons",
)  # fmt: skip
_EXECUTOR = (
    "host", "nodes", "process", "pid", "tid", "executor_kind", "callback_share", "callbacks",
    "seen_ns", "callback_ns", "blocked_ns", "longest_callback", "longest_ns",
)  # fmt: skip
_LOSS = ("topic", "subscriber", "published", "delivered", "dropped", "lost", "reasons")
_DISCARDED = """
SELECT coalesce(sum(event_count), 0)::BIGINT
FROM main.gap
WHERE kind = 'loss' AND start_ns >= $start_ns AND start_ns < $end_ns
"""
# How long messages were on the way, and data that nodes kept. A subscription that takes nothing
# though messages wait holds up the one that it took last, too: how long ago that was published.
_LONGEST = """
WITH message AS (
    SELECT d.subscription_id, d.reason, b.start_ns
    FROM main.stat_delivery AS d
    JOIN main.publication AS b ON d.publication_id = b.publication_id
),
taken AS (
    SELECT subscription_id, max(start_ns) AS start_ns
    FROM message
    WHERE reason IS NULL
    GROUP BY subscription_id
)
SELECT
    coalesce((SELECT max(latency_ns) FROM main.link_transport), 0),
    coalesce(
        (
            SELECT max($end_ns - t.start_ns)
            FROM message AS m
            JOIN taken AS t ON m.subscription_id = t.subscription_id
            WHERE m.reason IN ('pending_at_end', 'subscription_ended', 'unknown')
                AND m.start_ns > t.start_ns AND m.start_ns < $start_ns
        ),
        0
    ),
    coalesce((SELECT max(wait_ns) FROM main.link_causal), 0)
"""


@dataclass(frozen=True)
class WindowReport:
    """What happened in a window.

    Attributes:
        window: from when to when.
        is_final: all is known of it; else messages of its end may be on the way.
        lag_s: how old its last event is [s]; None of a recording that is finished.
        paths: rows of `e2e-latency`.
        executors: rows of `executor-usage`, the busiest first.
        losses: rows of `topics --measure delivery` with messages that were dropped or lost.
        discarded_events: events that the tracer lost.
        violations: what is not as the targets demand.
        verdicts: how many verdicts on the targets there are of each kind, as `verify` names them.
        longest_flow_ns: how long a message or a flow was on the way at most, or has been so far.
        longest_wait_ns: how long a node kept data at most.
    """

    window: Window
    is_final: bool
    paths: Sequence[Row]
    executors: Sequence[Row]
    losses: Sequence[Row]
    discarded_events: int
    longest_flow_ns: int
    longest_wait_ns: int
    violations: Sequence[Row] = field(default=())
    verdicts: Mapping[str, int] = field(default_factory=dict)
    lag_s: float | None = None

    def to_json(self) -> str:
        """Return it as one line of JSON."""
        shown = {
            **self.window.bindings,
            "is_final": self.is_final,
            "lag_s": self.lag_s if self.lag_s is None else round(self.lag_s, 3),
            "paths": self.paths,
            "executors": self.executors,
            "losses": self.losses,
            "discarded_events": self.discarded_events,
            "violations": self.violations,
            "verdicts": self.verdicts,
        }
        return json.dumps(shown, ensure_ascii=False, default=json_value)


def report_of(con: duckdb.DuckDBPyConnection, window: Window, last_step: Window) -> WindowReport:
    """Ask a database in memory what happened in a window.

    Args:
        con: with one run.
        window: which part of it counts.
        last_step: what came last: messages from before should have been taken by its end.

    Returns:
        The report, not marked as final.
    """

    def ask(name: str, columns: Sequence[str]) -> list[Row]:
        part = Slice(start=window.start_ns, end=window.end_ns)
        table = run_query(con, load_query(name), {}, part).table
        if "topic_name" in table.column_names:
            table = table.rename_columns({"topic_name": "topic"})
        rows: list[Row] = table.select(list(columns)).to_pylist()
        return rows

    paths = ask("e2e-latency", _PATH)
    executors = ask("executor-usage", _EXECUTOR)
    losses = ask("topics-delivery", _LOSS)
    on_way_ns, waiting_ns, kept_ns = longest_times(con, last_step)
    slowest_ns = max(on_way_ns, *(row["max_ns"] or 0 for row in paths), 0)
    return WindowReport(
        window=window,
        is_final=False,
        paths=paths,
        executors=sorted(executors, key=lambda row: -(row["callback_share"] or 0)),
        losses=[row for row in losses if row["dropped"] or row["lost"]],
        discarded_events=discarded_events(con, window),
        # What waits still has the rest of its path before it.
        longest_flow_ns=waiting_ns + slowest_ns,
        longest_wait_ns=kept_ns,
    )


def longest_times(con: duckdb.DuckDBPyConnection, last_step: Window) -> tuple[int, int, int]:
    """Return how long something took, or has taken so far.

    Args:
        con: with one run.
        last_step: messages from before should have been taken by its end.

    Returns:
        How long a message was on the way at most; how long ago the message was published that a
        subscription took last, though others wait for it since; how long a node kept data [ns].
    """
    ((on_way_ns, waiting_ns, kept_ns),) = con.execute(_LONGEST, last_step.bindings).fetchall()
    return int(on_way_ns), int(waiting_ns), int(kept_ns)


def discarded_events(con: duckdb.DuckDBPyConnection, window: Window) -> int:
    """Return how many events the tracer lost in a window.

    Args:
        con: with one run.
        window: which part of it counts.
    """
    ((discarded,),) = con.execute(_DISCARDED, window.bindings).fetchall()
    return int(discarded)
