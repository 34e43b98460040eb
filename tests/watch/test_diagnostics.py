"""Verdicts on targets as diagnostics: what they say, and how rclpy is asked to publish them."""

from __future__ import annotations

import sys
from contextlib import closing
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from msgflow.cli.app import app
from msgflow.errors import UsageError
from msgflow.run.window import Window
from msgflow.watch.alarm import violation_line
from msgflow.watch.diagnostics import Diagnostics
from msgflow.watch.window_report import WindowReport

PATH = "/camera → /image → /detector"
ROW = {
    "target": "image",
    "subject": PATH,
    "metric": "latency",
    "condition": "p99 < 10 ms",
    "measured": "61.000 ms",
    "value": 61e6,
    "worst_ns": 70_000_000,
    "reason": None,
    "path": PATH,
    "culprit": {"kind": "callback", "headline": "/detector: on_image takes 60 ms"},
    "flows": {"median_ns": 50_000_000, "p99_ns": 61_000_000, "lost": 2, "dropped": 1},
}


class Said(SimpleNamespace):
    """A message, or a part of one, with the fields that it was given."""


def named(name: str, **members: Any) -> ModuleType:
    module = ModuleType(name)
    vars(module).update(members)
    return module


@pytest.fixture
def published(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The name of the node, what a stand-in for rclpy publishes, and how it ends."""
    said: list[Any] = []

    class Node:
        def __init__(self, name: str, **_: object) -> None:
            said.append(name)

        def create_publisher(self, kind: type, topic: str, depth: int) -> Any:
            assert (kind, topic) == (array, "/diagnostics")
            return SimpleNamespace(publish=said.append, wait_for_all_acked=said.append)

        def get_clock(self) -> Any:
            return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=lambda: "now"))

        def destroy_node(self) -> None:
            said.append("destroyed")

    def array() -> Said:
        return Said(header=Said())

    status = type("Status", (Said,), {"OK": b"\0", "WARN": b"\1", "ERROR": b"\2", "STALE": b"\3"})
    context = SimpleNamespace(shutdown=lambda: said.append("shut down"))
    for module in (
        named("rclpy", Context=lambda: context, init=lambda **_: None),
        named("rclpy.duration", Duration=lambda seconds: seconds),
        named("rclpy.node", Node=Node),
        named("rclpy.signals", SignalHandlerOptions=SimpleNamespace(NO=0)),
        named("diagnostic_msgs"),
        named("diagnostic_msgs.msg", DiagnosticArray=array, DiagnosticStatus=status, KeyValue=Said),
    ):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return said


def report(*rows: dict[str, Any]) -> WindowReport:
    return WindowReport(Window(0, 1), [], [], [], 0, judged=rows, lag_s=0.42)


def test_a_target_is_a_status(published: list[Any]) -> None:
    passed = ROW | {"verdict": "passed", "target": "scan", "culprit": None, "flows": None}
    silent = passed | {"verdict": "no data", "target": "imu", "value": None, "reason": "silent"}
    unknown = silent | {"verdict": "not measured", "target": "odom", "reason": "events are missing"}
    failed = ROW | {"verdict": "failed"}
    with closing(Diagnostics()) as diagnostics:
        diagnostics.show(report(passed | {"target": "image"}, failed, passed, silent, unknown))
    node, message, *ended = published
    assert node == "msgflow_watch"
    assert ended == [1, "destroyed", "shut down"]
    assert message.header.stamp == "now"
    image, scan, imu, odom = message.status
    assert image.name == "msgflow: image"
    assert image.level == b"\2"
    assert image.message == (
        f"{PATH}: latency 61.000 ms, up to 70.000 ms, required p99 < 10 ms:"
        " /detector: on_image takes 60 ms"
    )
    assert {each.key: each.value for each in image.values} == {
        "p50": "50.000 ms",
        "p99": "61.000 ms",
        "lost": "3",
        "lag": "0.4 s",
    }
    assert [each.level for each in (scan, imu, odom)] == [b"\0", b"\3", b"\1"]
    assert imu.message == f"{PATH}: latency p99 < 10 ms: silent"
    assert [each.key for each in scan.values] == ["lag"]


def test_where_nothing_stands_out_it_says_what_takes_longest() -> None:
    culprit = {"kind": None, "headline": "nothing stands out", "evidence": ["longest takes Timer"]}
    line = violation_line(ROW | {"culprit": culprit, "is_final": True})
    assert line.endswith("required p99 < 10 ms: nothing stands out: longest takes Timer")


def test_what_diagnostics_need_is_said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(UsageError, match="--diagnostics needs rclpy and diagnostic_msgs") as raised:
        Diagnostics()
    assert "source /opt/ros" in str(raised.value.hint)
    result = CliRunner().invoke(app, ["watch", "--once", str(tmp_path), "--diagnostics"])
    assert result.exit_code == 2
    assert "--targets targets.yaml" in result.stderr
