"""What a window shows: rows of the named queries, as `msgflow query` prints them."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from msgflow.query.catalogue import load_query
from msgflow.query.runner import bind
from msgflow.query.selection import INTERNAL_COLUMN
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
    "host", "process", "pid", "tid", "executor_kind", "callback_share", "callbacks", "seen_ns",
    "callback_ns", "blocked_ns",
)  # fmt: skip
_LOSS = ("topic_name", "subscriber", "published", "delivered", "dropped", "lost", "reasons")
_RUNS = "SELECT run_id FROM store.run"
_DISCARDED = """
SELECT coalesce(sum(event_count), 0)::BIGINT
FROM main.gap
WHERE kind = 'loss' AND start_ns >= $start_ns AND start_ns < $end_ns
"""
# How long messages were on the way, and data that nodes kept.
_LONGEST = """
SELECT greatest(
    (SELECT coalesce(max(latency_ns), 0) FROM main.link_transport),
    (SELECT coalesce(max(wait_ns), 0) FROM main.link_causal WHERE kind <> 'direct')
)
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
        longest_ns: how long a message or data that a node kept was on the way at most.
    """

    window: Window
    is_final: bool
    paths: Sequence[Row]
    executors: Sequence[Row]
    losses: Sequence[Row]
    discarded_events: int
    longest_ns: int
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


def report_of(con: duckdb.DuckDBPyConnection, window: Window, *, is_final: bool) -> WindowReport:
    """Ask a database in memory what happened in a window.

    Args:
        con: with one run.
        window: which part of it counts.
        is_final: see `WindowReport`.
    """

    runs = [run_id for (run_id,) in con.execute(_RUNS).fetchall()]

    def ask(name: str, columns: Sequence[str]) -> list[Row]:
        # What a user may get wrong, or wants to know beside the rows, takes a third of the time.
        header = load_query(name)
        (statement,) = con.extract_statements(header.body)
        values = bind(header, {}) | {"runs": runs, **window.bindings}
        con.execute(statement, {used: values[used] for used in statement.named_parameters})
        names = [name for name, *_ in con.description or ()]
        rows = [dict(zip(names, row, strict=True)) for row in con.fetchall()]
        return [
            {column.removesuffix("_name"): row[column] for column in columns}
            for row in rows
            if not row.get(INTERNAL_COLUMN)
        ]

    paths = ask("e2e-latency", _PATH)
    executors = ask("executor-usage", _EXECUTOR)
    losses = ask("topics-delivery", _LOSS)
    ((discarded,),) = con.execute(_DISCARDED, window.bindings).fetchall()
    ((longest,),) = con.execute(_LONGEST).fetchall()
    return WindowReport(
        window=window,
        is_final=is_final,
        paths=paths,
        executors=sorted(executors, key=lambda row: -(row["callback_share"] or 0)),
        losses=[row for row in losses if row["dropped"] or row["lost"]],
        discarded_events=discarded,
        longest_ns=max(longest, *(row["max_ns"] or 0 for row in paths), 0),
    )
