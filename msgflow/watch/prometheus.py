"""Metrics for Prometheus: what was counted since the begin, and how it is now."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from itertools import groupby, islice
from operator import itemgetter
from threading import Lock
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow.sql.statement import internal_sql, registered
from msgflow.text.installation import install_command
from msgflow.watch.window_report import discarded_events

if TYPE_CHECKING:
    import duckdb
    from prometheus_client.metrics_core import Metric

    from msgflow.run.window import Window
    from msgflow.watch.window_report import WindowReport

BOUNDS_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Bounds of the buckets of latencies [s]."""

MOST_LABELS = 1_000
"""Paths, subscriptions that lost messages, violated targets and counters of a kind, at most."""

_SECOND_NS = 1_000_000_000
# Where clocks are apart, latencies may be negative: a sum that falls would be no counter.
_PATHS = """
SELECT
    path, histogram(status), sum(greatest(latency_ns, 0))::BIGINT, count(latency_ns),
    list_transform(
        $bounds, lambda bound: len(list_filter(list(latency_ns), lambda ns: ns <= bound * 1e9))
    )
FROM watched_flow
GROUP BY path
"""
_LOSSES = """
SELECT s.topic_name, main.node_label(n.full_name, p.name, p.pid), d.status, d.reason, count(*)
FROM main.stat_delivery AS d
JOIN main.publication AS b ON d.publication_id = b.publication_id
JOIN main.subscription AS s ON d.subscription_id = s.subscription_id
JOIN main.process AS p ON s.process_id = p.process_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
WHERE d.status IN ('dropped', 'lost') AND NOT s.is_internal
    AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
GROUP BY ALL
"""


class Exporter:
    """Metrics of a recording that is watched; `serve` lets Prometheus read them."""

    def __init__(self) -> None:
        # The server reads in threads of its own.
        self._lock = Lock()
        # By path, the last seen last: flows by status; of latencies their sum [ns], their number,
        # and how many are in each bucket.
        self._paths: dict[str, tuple[Counter[str], list[int]]] = {}
        self._losses: Counter[tuple[str, ...]] = Counter()
        self._violations: Counter[tuple[str, ...]] = Counter()
        self._discarded = 0
        # Of the last part: kind, node or host, topic or program, value.
        self._counters: list[tuple[str, str, str, float]] = []
        self._last: WindowReport | None = None
        self._shown_s = 0.0

    def serve(self, place: str) -> None:
        """Serve /metrics in a thread, at a port of 127.0.0.1 or ADDRESS:PORT."""
        try:
            from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest
        except ImportError:
            raise UsageError(
                "prometheus-client is not installed", install_command("prometheus-client")
            ) from None
        from msgflow.view.server import HOST, serve_text

        address, _, port = place.rpartition(":")
        registry = CollectorRegistry()
        registry.register(self)
        try:
            serve_text(
                address.strip("[]") or HOST,
                int(port),
                lambda: generate_latest(registry),
                CONTENT_TYPE_LATEST,
            )
        except (OSError, ValueError, OverflowError) as error:
            raise UsageError(
                f"cannot serve metrics at {place}: {error}", "--prometheus 9464"
            ) from error

    def count(self, con: duckdb.DuckDBPyConnection, part: Window) -> None:
        """Count what happened in a further part of the recording, of which all is known."""
        times = Slice(start=part.start_ns, end=part.end_ns)
        flows = run_query(con, load_query("flows"), {}, times).table
        losses = con.execute(_LOSSES, part.bindings).fetchall()
        with registered(con, watched_flow=flows):
            paths = con.execute(_PATHS, {"bounds": list(BOUNDS_S)}).fetchall()
        runs = [run.run_id for run in Slice("all").runs(con)]
        values = {"runs": runs, **part.bindings}
        counters = internal_sql().run(con, "watched_counter", values).fetchall()
        discarded = discarded_events(con, part)
        with self._lock:
            for path, statuses, total_ns, number, buckets in paths:
                further = [total_ns, number, *buckets]
                known, before = self._paths.pop(path, (Counter(), [0] * len(further)))
                known.update(statuses)
                self._paths[path] = known, [sum(pair) for pair in zip(before, further, strict=True)]
            for *labels, number in losses:
                self._losses[tuple(labels)] = self._losses.pop(tuple(labels), 0) + number
            self._discarded += discarded
            self._counters = [
                each
                for _, alike in groupby(counters, key=itemgetter(0))
                for each in islice(alike, MOST_LABELS)
            ]
            self._forget()

    def _forget(self) -> None:
        """Drop the labels that were seen longest ago: restarts make new ones, for ever."""
        for known in (self._paths, self._losses, self._violations):
            for labels in [*known][: max(len(known) - MOST_LABELS, 0)]:
                del known[labels]

    def show(self, report: WindowReport) -> None:
        """Take over how it is now."""
        with self._lock:
            self._last = report
            self._shown_s = time.monotonic()
            for each in report.violations:
                names = each["subject"], each["metric"]
                self._violations[names] = self._violations.pop(names, 0) + 1
            self._forget()

    def collect(self) -> Iterator[Metric]:
        """Yield all metrics, as a registry of prometheus-client asks for them."""
        with self._lock:
            metrics = [*self._counted(), *self._gauges()]
        yield from metrics

    def _counted(self) -> Iterator[Metric]:
        from prometheus_client.core import CounterMetricFamily, HistogramMetricFamily

        latency = HistogramMetricFamily(
            "msgflow_path_latency_seconds", "Latency from end to end", labels=["path"]
        )
        for path, (_, (total_ns, number, *counts)) in self._paths.items():
            buckets = list(zip(map(str, BOUNDS_S), counts, strict=True))
            latency.add_metric([path], [*buckets, ("+Inf", number)], total_ns / _SECOND_NS)
        yield latency
        statuses = {
            (path, status): number
            for path, (known, _) in self._paths.items()
            for status, number in known.items()
        }
        for name, meaning, labels, counted in (
            (
                "msgflow_path_flows", "Flows by what became of them",
                ["path", "status"], statuses,
            ),
            (
                "msgflow_messages_undelivered", "Messages that a subscription did not get",
                ["topic", "subscriber", "kind", "reason"], self._losses,
            ),
            (
                "msgflow_violations", "Targets that were not met",
                ["subject", "metric"], self._violations,
            ),
        ):  # fmt: skip
            family = CounterMetricFamily(name, meaning, labels=labels)
            for values, number in counted.items():
                family.add_metric(list(values), number)
            yield family
        yield CounterMetricFamily(
            "msgflow_discarded_events", "Events that the tracer lost", value=self._discarded
        )

    def _gauges(self) -> Iterator[Metric]:
        from prometheus_client.core import GaugeMetricFamily

        busy = GaugeMetricFamily(
            "msgflow_executor_busy_ratio", "Part of its time that a thread is in callbacks",
            labels=["host", "nodes", "tid"],
        )  # fmt: skip
        lag = GaugeMetricFamily(
            "msgflow_watch_lag_seconds", "Age of the last event that a window had"
        )
        for row in self._last.executors if self._last is not None else ():
            labels = [row["host"] or "", row["nodes"] or "", str(row["tid"])]
            busy.add_metric(labels, row["callback_share"] or 0)
        if self._last is not None and self._last.lag_s is not None:
            # It grows where no window comes any more.
            lag.add_metric([], self._last.lag_s + time.monotonic() - self._shown_s)
        yield busy
        yield lag
        for kind, name, meaning, labels in (
            ("rate", "msgflow_topic_rate_hertz", "Messages in a second", ["node", "topic"]),
            (
                "queue", "msgflow_queue_messages", "Most messages that waited to be taken",
                ["subscriber", "topic"],
            ),
            ("cpu", "msgflow_program_cpus", "CPUs that a program used", ["host", "program"]),
        ):  # fmt: skip
            gauge = GaugeMetricFamily(name, meaning, labels=labels)
            for of, owner, what, value in self._counters:
                if of == kind:
                    gauge.add_metric([owner or "", what], value)
            yield gauge
