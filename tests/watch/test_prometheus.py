"""Metrics for Prometheus: each flow is counted once, whatever the windows."""

from __future__ import annotations

import json
import re
import socket
import threading
import urllib.error
import urllib.request
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pyarrow.compute as pc
import pytest

from msgflow.clocks.clocks_file import read_clock_sync
from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.query.runner import run_query
from msgflow.run.window import Window
from msgflow.watch.follow import watch_finished
from msgflow.watch.prometheus import BOUNDS_S, Exporter
from msgflow.watch.watcher import Watcher
from msgflow.watch.window_report import WindowReport
from msgflow_sim import Recording, simulate

prometheus = pytest.importorskip("prometheus_client")
DASHBOARD = Path(__file__).resolve().parents[2] / "docs" / "grafana-dashboard.json"
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def recording(shared_traces: Path) -> Path:
    return shared_traces / "real_rotate"


@pytest.fixture(scope="module")
def exporter(recording: Path) -> Exporter:
    """What was counted in windows of six seconds, three seconds from each other."""
    exporter = Exporter()
    watcher = Watcher(
        window_ns=6 * SECOND,
        step_ns=3 * SECOND,
        late_ns=3 * SECOND,
        links=None,
        clocks=read_clock_sync("none"),
        note=lambda text: None,
        exporter=exporter,
    )
    assert len(list(watch_finished(recording, watcher))) > 1
    return exporter


def test_each_flow_is_counted_once(exporter: Exporter, real: Callable[[str], Path]) -> None:
    with Database(real("real_rotate")) as whole:
        rows = whole.query("flows").to_arrow().to_pylist()
    families = {family.name: family for family in exporter.collect()}
    found = Counter(
        {
            (sample.labels["path"], sample.labels["status"]): int(sample.value)
            for sample in families["msgflow_path_flows"].samples
        }
    )
    assert found == Counter((row["path"], row["status"]) for row in rows)
    latencies = [row["latency_ns"] for row in rows if row["latency_ns"] is not None]
    samples = families["msgflow_path_latency_seconds"].samples

    def total(name: str, **labels: str) -> float:
        return sum(
            sample.value
            for sample in samples
            if sample.name.endswith(name) and labels.items() <= sample.labels.items()
        )

    assert total("_count") == total("_bucket", le="+Inf") == len(latencies)
    assert total("_sum") == pytest.approx(sum(latencies) / SECOND)
    below = sum(latency <= 0.01 * SECOND for latency in latencies)
    assert total("_bucket", le="0.01") == below
    assert families["msgflow_discarded_events"].samples[0].value == 12


def test_the_dashboard_asks_for_what_is_served(exporter: Exporter) -> None:
    registry = prometheus.CollectorRegistry()
    registry.register(exporter)
    text = prometheus.generate_latest(registry).decode()
    served = set(re.findall(r"^# (?:HELP|TYPE) (\w+)", text, re.MULTILINE))
    panels = json.loads(DASHBOARD.read_text())["panels"]
    asked = {
        name.removesuffix("_bucket")
        for panel in panels
        for target in panel["targets"]
        for name in re.findall(r"msgflow_\w+", target["expr"])
    }
    assert asked <= served
    assert len(asked) == len(panels) - 1


def metrics(exporter: Exporter, family: str) -> dict[tuple[str, ...], float]:
    """Return the samples of a family, by the values of their labels."""
    (found,) = [each for each in exporter.collect() if each.name == family]
    return {tuple(sample.labels.values()): sample.value for sample in found.samples}


@pytest.mark.thorough
def test_the_sum_of_latencies_does_not_fall_and_losses_have_reasons(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Clocks that are apart make latencies negative."""
    apart_ns = 2_000_000

    def with_clocks_apart(*words: Any) -> Any:
        result = run_query(*words)
        place = result.table.schema.get_field_index("latency_ns")
        apart = pc.subtract(result.table["latency_ns"], apart_ns)
        return replace(result, table=result.table.set_column(place, "latency_ns", apart))

    monkeypatch.setattr("msgflow.watch.prometheus.run_query", with_clocks_apart)
    directory = tmp_path / "trace"
    simulate("losses", directory, factor=0.3, recording=Recording(rotations=(SECOND // 2, SECOND)))
    exporter = Exporter()
    watcher = Watcher(
        window_ns=SECOND,
        step_ns=SECOND // 2,
        late_ns=SECOND // 2,
        links=None,
        clocks=read_clock_sync("none"),
        note=lambda text: None,
        exporter=exporter,
    )
    assert list(watch_finished(directory, watcher))
    watcher.close()
    with Database(tmp_path / "whole.duckdb") as whole:
        whole.ingest([directory])
        flows = whole.query("flows").to_arrow().to_pylist()
        delivery = whole.query("topics-delivery").to_arrow().to_pylist()
    known = [row["latency_ns"] for row in flows if row["latency_ns"] is not None]
    latencies = [latency - apart_ns for latency in known]
    assert min(latencies) < 0 < max(latencies)
    (family,) = [each for each in exporter.collect() if each.name.endswith("path_latency_seconds")]
    sums = [sample.value for sample in family.samples if sample.name.endswith("_sum")]
    assert sum(sums) == pytest.approx(sum(max(each, 0) for each in latencies) / SECOND)
    found = metrics(exporter, "msgflow_messages_undelivered")
    assert found
    for kind in ("dropped", "lost"):
        counts = sum(value for labels, value in found.items() if labels[2] == kind)
        assert counts == sum(row[kind] for row in delivery)
    reasons = {reason for row in delivery for reason, _ in row["reasons"] or ()}
    assert all(labels[3] in reasons for labels in found)


def shown(*violations: dict[str, str], lag_s: float | None = None) -> WindowReport:
    return WindowReport(
        window=Window(0, SECOND),
        paths=(),
        executors=(),
        losses=(),
        discarded_events=0,
        violations=violations,
        lag_s=lag_s,
    )


def test_busy_threads_go_by_their_nodes() -> None:
    """Of rclpy, all processes are called python."""
    exporter = Exporter()
    thread = {"host": "robot", "nodes": "/camera", "process": "python3", "tid": 7}
    idle = {"host": None, "nodes": "/b", "process": "python3", "tid": 8, "callback_share": None}
    exporter.show(replace(shown(), executors=[{**thread, "callback_share": 0.5}, idle]))
    assert metrics(exporter, "msgflow_executor_busy_ratio") == {
        ("robot", "/camera", "7"): 0.5,
        ("", "/b", "8"): 0,
    }


def test_violations_are_counted() -> None:
    exporter = Exporter()
    late, rare = {"subject": "/a", "metric": "latency"}, {"subject": "/b", "metric": "rate"}
    for report in (shown(late, rare), shown(), shown(late)):
        exporter.show(report)
    assert metrics(exporter, "msgflow_violations") == {
        ("/a", "latency"): 2,
        ("/b", "rate"): 1,
    }


def test_the_lag_grows_where_nothing_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A robot that is dead has no windows."""
    now = 50.0
    # Not the clock of this process: servers of other tests run by it, and would wait for ever.
    clock = SimpleNamespace(monotonic=lambda: now)
    monkeypatch.setattr("msgflow.watch.prometheus.time", clock)
    exporter = Exporter()
    assert metrics(exporter, "msgflow_watch_lag_seconds") == {}
    exporter.show(shown(lag_s=1.5))
    assert metrics(exporter, "msgflow_watch_lag_seconds") == {(): 1.5}
    now = 110.0
    assert metrics(exporter, "msgflow_watch_lag_seconds") == {(): 61.5}
    exporter.show(shown(lag_s=2.0))
    assert metrics(exporter, "msgflow_watch_lag_seconds") == {(): 2.0}
    # A finished recording has none.
    exporter.show(shown())
    assert metrics(exporter, "msgflow_watch_lag_seconds") == {}


def test_what_has_gone_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("msgflow.watch.prometheus.MOST_LABELS", 2)
    exporter = Exporter()
    for number in (0, 1, 2, 0, 3):
        path = f"/p{number}"
        exporter._paths[path] = Counter(reached=1, lost=1), [0] * (2 + len(BOUNDS_S))
        exporter._losses[path, "[a 1]", "lost", "?"] = 1
        exporter.show(shown({"subject": path, "metric": "latency"}))
    assert metrics(exporter, "msgflow_path_flows") == {
        ("/p0", "reached"): 1,
        ("/p0", "lost"): 1,
        ("/p3", "reached"): 1,
        ("/p3", "lost"): 1,
    }
    assert len(metrics(exporter, "msgflow_messages_undelivered")) == 2
    assert metrics(exporter, "msgflow_violations") == {
        ("/p0", "latency"): 1,
        ("/p3", "latency"): 1,
    }


def test_another_host_is_refused_and_open_connections_take_no_thread(
    exporter: Exporter, unused_port: int
) -> None:
    exporter.serve(str(unused_port))
    before = threading.active_count()
    with ExitStack() as stack:
        for _ in range(100):
            stack.enter_context(socket.create_connection(("127.0.0.1", unused_port)))
        request = urllib.request.Request(
            f"http://127.0.0.1:{unused_port}/metrics", headers={"Host": "evil.example"}
        )
        with pytest.raises(urllib.error.HTTPError, match="421"):
            urllib.request.urlopen(request)
        assert threading.active_count() <= before + 1


def test_metrics_are_served(exporter: Exporter, unused_port: int) -> None:
    exporter.serve(str(unused_port))
    with urllib.request.urlopen(f"http://127.0.0.1:{unused_port}/metrics") as answer:
        assert b"msgflow_path_latency_seconds_bucket" in answer.read()
    with pytest.raises(UsageError, match="cannot serve metrics"):
        exporter.serve(str(unused_port))


@pytest.fixture
def unused_port() -> int:
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


def test_counters_of_one_kind_leave_room_for_those_of_others(
    real: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("msgflow.watch.prometheus.MOST_LABELS", 1)
    exporter = Exporter()
    with Database(real("real_rotate")) as whole:
        ((start_ns, end_ns),) = whole.connection.execute(
            "SELECT start_ns, end_ns FROM run"
        ).fetchall()
        exporter.count(whole.connection, Window(start_ns, end_ns))
    found = {each.name: len(each.samples) for each in exporter.collect()}
    assert found["msgflow_topic_rate_hertz"] == found["msgflow_queue_messages"] == 1
