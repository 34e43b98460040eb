"""Metrics for Prometheus: each flow is counted once, whatever the windows."""

from __future__ import annotations

import json
import re
import urllib.request
from collections import Counter
from pathlib import Path

import pytest

from msgflow.clocks import read_clock_sync
from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.watch import Exporter, Watcher, kept_chunk, watch_finished

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
        links=None,
        clocks=read_clock_sync("none"),
        note=lambda text: None,
        exporter=exporter,
    )
    assert len(list(watch_finished(recording, watcher))) > 1
    return exporter


def test_each_flow_is_counted_once(exporter: Exporter, recording: Path, tmp_path: Path) -> None:
    with Database(tmp_path / "whole.duckdb") as whole:
        whole.ingest([recording])
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


def test_a_topic_may_have_no_name(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its publishers and subscriptions were created before the recording."""
    exporter = Exporter()
    watcher = Watcher(
        window_ns=8 * SECOND,
        step_ns=8 * SECOND,
        links=None,
        clocks=read_clock_sync("none"),
        note=lambda text: None,
        exporter=exporter,
    )
    wanted = kept_chunk.wanted_events
    monkeypatch.setattr(kept_chunk, "wanted_events", lambda: wanted(["*:rcl_*_init", "dds:*"]))
    for _ in watch_finished(recording, watcher):
        pass
    registry = prometheus.CollectorRegistry()
    registry.register(exporter)
    assert b'topic="?"' in prometheus.generate_latest(registry)


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
