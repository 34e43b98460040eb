"""What a window shows: rows of the named queries, as `msgflow query` prints them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import duckdb

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow.run.window import Window
from msgflow.text.json_value import json_value

Row = dict[str, Any]

_PATH = (
    "path", "roots", "reached", "superseded", "dropped", "lost", "no_output", "not_connected",
    "unknown", "cut_by_recording", "loss_affected", "ambiguous", "median_ns", "p99_ns", "max_ns",
    "reasons",
)  # fmt: skip
_EXECUTOR = (
    "host", "nodes", "process", "pid", "tid", "executor_kind", "callback_share", "callbacks",
    "seen_ns", "callback_ns", "blocked_ns", "longest_callback", "longest_ns",
)  # fmt: skip
_LOSS = ("topic", "subscriber", "published", "delivered", "dropped", "lost", "reasons")
_TOPIC = (
    "topic", "publication_count", "rate_hz", "period_median_ns", "period_deviation_ns",
    "delivered", "dropped", "lost", "reasons", "latency_median_ns", "latency_p95_ns",
    "latency_max_ns",
)  # fmt: skip
_DISCARDED = """
SELECT coalesce(sum(event_count), 0)::BIGINT
FROM main.gap
WHERE kind = 'loss' AND start_ns >= $start_ns AND start_ns < $end_ns
"""


@dataclass(frozen=True)
class WindowReport:
    """What happened in a window."""

    window: Window  # from when to when
    paths: Sequence[Row]  # rows of `e2e-latency`
    executors: Sequence[Row]  # rows of `executor-usage`, the busiest first
    # Rows of `topics --measure delivery` with messages that were dropped or lost.
    losses: Sequence[Row]
    discarded_events: int  # events that the tracer lost
    topics: Sequence[Row] = field(default=())  # rows of `topics --measure summary`
    late_events: int = 0  # events that have come since the last window, but belong to closed ones
    violations: Sequence[Row] = field(default=())  # what is not as the targets demand
    # Timers and topics that stopped, as `Silences.further` returns them.
    stopped: Sequence[Row] = field(default=())
    judged: Sequence[Row] = field(default=())  # rows of `verify`, as `Alarm.judge` returns them
    # How old its last event is [s]; None of a recording that is finished.
    lag_s: float | None = None

    @property
    def verdicts(self) -> Counter[str]:
        """How many verdicts on the targets there are of each kind, as `verify` names them."""
        return Counter(row["verdict"] for row in self.judged)

    def to_json(self) -> str:
        """Return it as one line of JSON."""
        shown = {
            **self.window.bindings,
            "lag_s": self.lag_s if self.lag_s is None else round(self.lag_s, 3),
            "paths": self.paths,
            "executors": self.executors,
            "losses": self.losses,
            "topics": self.topics,
            "discarded_events": self.discarded_events,
            "late_events": self.late_events,
            "violations": self.violations,
            "stopped": self.stopped,
            "verdicts": self.verdicts,
        }
        return json.dumps(shown, ensure_ascii=False, default=json_value)


def report_of(con: duckdb.DuckDBPyConnection, window: Window) -> WindowReport:
    """Ask a database in memory what happened in a window."""

    def ask(name: str, columns: Sequence[str]) -> list[Row]:
        part = Slice(start=window.start_ns, end=window.end_ns)
        table = run_query(con, load_query(name), {}, part).table
        if "topic_name" in table.column_names:
            table = table.rename_columns({"topic_name": "topic"})
        rows: list[Row] = json_value(table.select(list(columns)).to_pylist())
        return rows

    paths = ask("e2e-latency", _PATH)
    executors = ask("executor-usage", _EXECUTOR)
    losses = ask("topics-delivery", _LOSS)
    return WindowReport(
        window=window,
        paths=paths,
        executors=sorted(executors, key=lambda row: -(row["callback_share"] or 0)),
        losses=[row for row in losses if row["dropped"] or row["lost"]],
        topics=ask("topics-summary", _TOPIC),
        discarded_events=discarded_events(con, window),
    )


def discarded_events(con: duckdb.DuckDBPyConnection, window: Window) -> int:
    """Return how many events the tracer lost in a window."""
    ((discarded,),) = con.execute(_DISCARDED, window.bindings).fetchall()
    return int(discarded)
