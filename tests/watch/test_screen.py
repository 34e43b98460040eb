"""The screen of `msgflow watch`."""

from __future__ import annotations

import io

from rich.console import Console

from msgflow.cli.show.watch_screen import WatchScreen
from msgflow.run.window import Window
from msgflow.watch.window_report import WindowReport

FATES = {"dropped": 0, "lost": 0, "no_output": 0, "unknown": 3, "ambiguous": 0}


def shown(*reports: WindowReport) -> str:
    """Return the screen after these windows."""
    console = Console(file=io.StringIO(), width=80, height=40)
    screen = WatchScreen(console)
    for report in reports:
        last = screen.of(report)
    with console.capture() as capture:
        console.print(last)
    return capture.get()


def test_names_are_text_and_all_fits() -> None:
    """A program may call itself what it likes: no markup, no control characters."""
    times = {"median_ns": 1_000_000, "p99_ns": 2_000_000, "max_ns": 2_000_000}
    thread = {"nodes": "[/x] \x1b[31m", "tid": 7, "callback_share": 0.5, "longest_ns": 48_100_000}
    topic = {"topic": "[/y]" * 40, "dropped": 4, "lost": 0, "reasons": {"[r] " * 40: 4}}
    topic |= {"rate_hz": 1e4, "period_deviation_ns": 123_400_000, "latency_p95_ns": 123_400_000}
    report = WindowReport(
        window=Window(0, 2_000_000_000),
        paths=[{"path": "[/z] → \x1b[2J", "reached": 20, **FATES, **times}],
        executors=[{**thread, "blocked_ns": 0, "longest_callback": "Subscription(/[b])"}],
        losses=(),
        topics=[topic],
        discarded_events=0,
    )
    text = shown(report)
    assert all(name in text for name in ("[/x]", "[/y]", "[/z]"))
    assert "48.1 ms  Subscription(/[b])" in text
    assert "\x1b" not in text
    assert max(map(len, text.splitlines())) <= 80


def test_latencies_may_be_negative() -> None:
    """Clocks of two hosts are apart."""
    reports = [
        WindowReport(
            window=Window(0, 2_000_000_000),
            paths=[
                {"path": "/z", "reached": 1, **FATES, "median_ns": most, "p99_ns": most}
                | {"max_ns": most}
            ],
            executors=(),
            losses=(),
            discarded_events=0,
        )
        for most in (-7_000_000, 3_000_000, -2_000_000)
    ]
    assert "-2 ms" in shown(reports[0], reports[2])
    assert "▁█▁" in shown(*reports)


def test_latencies_by_links_that_may_be_others_are_doubted() -> None:
    path = {"path": "/z", "reached": 9, "median_ns": 2_000_000, "p99_ns": None, "max_ns": 3_000_000}
    report = WindowReport(
        window=Window(0, 2_000_000_000),
        paths=[path | FATES | {"ambiguous": 1}],
        executors=(),
        losses=(),
        discarded_events=0,
    )
    assert "2 ms?" in shown(report)


def test_long_names_leave_the_columns_whole() -> None:
    """In a terminal of 80 columns."""
    thread = {
        "nodes": "/perception/lidar/points, 3 more",
        "tid": 123_456,
        "callback_share": 1.0,
        "blocked_ns": 312_000_000,
        "longest_ns": 45_600_000,
        "longest_callback": "/perception/lidar/points Subscription(/lidar/top/pointcloud)",
    }
    report = WindowReport(
        window=Window(0, 2_000_000_000),
        paths=(),
        executors=[thread],
        losses=(),
        discarded_events=0,
    )
    (line,) = [line for line in shown(report).splitlines() if "100 %" in line]
    assert line.split("  ")[-3:-1] == [" 312 ms", "45.6 ms"]
    assert line.endswith("pointcloud)")
    assert "busy  blocked  longest  callback" in shown(report)
