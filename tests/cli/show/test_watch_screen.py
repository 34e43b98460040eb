"""The screen of `msgflow watch`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from rich.console import Console, RenderableType

from msgflow.cli.show.watch_screen import WatchScreen
from msgflow.run.window import Window
from msgflow.watch.window_report import WindowReport

START_NS = 1_700_000_000_000_000_000
MS = 1_000_000


def path(name: str, max_ms: float, lost: int = 0) -> dict[str, Any]:
    others = ("roots", "superseded", "dropped", "no_output", "not_connected", "unknown")
    others += ("cut_by_recording",)
    return dict.fromkeys(others, 0) | {
        "path": name,
        "reached": 100,
        "ambiguous": 0,
        "lost": lost,
        "median_ns": int(max_ms * MS / 2),
        "p99_ns": int(max_ms * MS),
        "max_ns": int(max_ms * MS),
        "reasons": None,
    }


def report(*paths: dict[str, Any], **more: Any) -> WindowReport:
    executor = {"nodes": "/detector", "tid": 77, "callback_share": 0.5, "callbacks": 100}
    executor |= {"blocked_ns": 0, "longest_ns": 60 * MS, "longest_callback": None}
    window = Window(START_NS, START_NS + 10_000 * MS)
    given = {
        "losses": (),
        "discarded_events": 0,
        "lag_s": 1.25,
    } | more
    return WindowReport(window, paths, [executor], **given)


def terminal(width: int = 80, height: int = 40) -> Console:
    return Console(width=width, height=height, force_terminal=False)


def new_screen() -> WatchScreen:
    return WatchScreen(terminal())


def printed(shown: RenderableType, console: Console) -> list[str]:
    with console.capture() as capture:
        console.print(shown)
    return [line.rstrip() for line in capture.get().splitlines()]


def lines(screen: WatchScreen, shown: WindowReport) -> list[str]:
    return printed(screen.of(shown), terminal())


def test_what_is_worst_comes_first() -> None:
    found = lines(new_screen(), report(path("/a → /b", 80), path("/c → /d", 5, lost=3)))
    assert found[0] == "22:13:20 to 22:13:30   2 paths   lag 1.2 s   0 events lost by the tracer"
    late = lines(new_screen(), report(late_events=1_200))
    assert " ".join(late).count("1,200 events came late") == 1
    order = [line.split()[0] for line in found if line.startswith(("/a", "/c"))]
    assert order == ["/c", "/a"]
    assert next(line for line in found if line.startswith("/a")).split()[3:10] == [
        "10",
        "40",
        "ms",
        "80",
        "ms",
        "80",
        "ms",
    ]
    assert any(line.split()[:3] == ["/detector", "77", "50"] for line in found)


@pytest.mark.parametrize("length", [10, 300])
def test_it_fits_80_columns(length: int) -> None:
    screen = new_screen()
    topic = {"dropped": 12, "lost": 0, "reasons": {"r" * 99: 12}, "rate_hz": 20.4}
    topic |= {"period_deviation_ns": 3 * MS, "latency_p95_ns": 7 * MS}
    silent = dict.fromkeys(topic) | {"topic": "/silent", "dropped": 0, "lost": 0}
    topics = [silent, topic | {"topic": "/t" * length}]
    for _ in range(12):
        found = lines(screen, report(path("/x" * length, 175.6), topics=topics))
    assert max(map(len, found)) <= 80
    assert sum(line.count("  176 ms") for line in found) == 2
    lost, quiet = (line.split() for line in found[-3:-1])
    assert lost[1:8] == ["20", "3", "ms", "7", "ms", "12", "0"]
    assert quiet[:2] == ["/silent", "0"]
    # Ten steps, all of them as slow.
    assert any("█" * 10 in line for line in found)


def test_a_violation_stays_on_the_screen() -> None:
    violation = {
        "subject": "/cmd",
        "path": None,
        "metric": "latency",
        "condition": "max < 80 ms",
        "measured": "182.000 ms",
        "worst_ns": 182 * MS,
        "is_final": False,
        "culprit": {"kind": "callback", "headline": "/detector: on_image takes 141 ms"},
    }
    screen = new_screen()
    lines(screen, report(violations=[violation]))
    text = " ".join(lines(screen, report()))
    assert "22:13:30 /cmd: latency 182.000 ms, required max < 80 ms: /detector: on_image" in text
    assert "(provisional)" in text


def after(screen: WatchScreen, *keys: str) -> list[str]:
    """Return the lines of the screen after the last of these keys."""
    for key in keys:
        shown = screen.after_key(key)
    assert shown is not None
    return printed(shown, terminal())


def test_keys_choose_the_order() -> None:
    screen = new_screen()
    assert screen.after_key("s") is None  # nothing is shown yet
    lines(screen, report(path("/a", 80), path("/c", 5, lost=3)))
    found = after(screen, "s")
    assert "max▾" in found[1]
    assert [line.split()[0] for line in found if line.startswith(("/a", "/c"))] == ["/a", "/c"]
    # After the last column the first one follows.
    assert "missing▾" in after(screen, "s", "s", "s", "s", "s")[1]
    assert screen.after_key("x") is None


def test_a_path_that_is_picked_is_seen_with_its_fates() -> None:
    """It stays the same if another becomes worse, also below those that have room."""
    screen = WatchScreen(terminal(height=20))
    paths = [path(f"/p{number:02}", 100 - number) for number in range(20)]
    lines(screen, report(*paths))
    found = after(screen, *["down"] * 14, "up")
    assert len(found) == 20
    assert "/p12" in [line.split()[0] for line in found]
    assert "/p00" not in [line.split()[0] for line in found]
    assert "0 flows: 100 reached" in found
    found = lines(screen, report(*paths, path("/worse", 200, lost=1)))
    assert found[found.index("0 flows: 100 reached") - 1] == "/p12"
    assert "0 flows: 100 reached" not in after(screen, "escape")


VIOLATION = {
    "subject": "/scan → /cmd",
    "path": "/source → /scan → /filter → /cmd → /sink",
    "metric": "latency",
    "condition": "max < 80 ms",
    "measured": "182.000 ms",
    "worst_ns": 182 * MS,
    "is_final": False,
    "culprit": {
        "kind": "callback",
        "headline": "/filter: Filter.on_scan (Subscription(/scan)) takes 139 ms in 9 of 80 calls",
    },
}


@pytest.mark.parametrize("width", [80, 100])
@pytest.mark.parametrize("height", [16, 24, 30, 50])
@pytest.mark.parametrize("violations", [0, 1, 5])
@pytest.mark.parametrize("has_topics", [False, True])
def test_it_is_as_high_as_the_terminal_at_most(
    width: int, height: int, violations: int, has_topics: bool
) -> None:
    """What is violated, all tables and the keys are seen in each."""
    console = terminal(width, height)
    screen = WatchScreen(console)
    topic = {
        "topic": "/t",
        "dropped": 12,
        "lost": 0,
        "reasons": {"overwritten": 12},
        "rate_hz": 9.8,
    }
    topic |= {"period_deviation_ns": None, "latency_p95_ns": 7 * MS}
    executor = {"nodes": "/detector", "tid": 77, "callback_share": 0.5, "callbacks": 100}
    executor |= {"blocked_ns": 0, "longest_ns": 60 * MS, "longest_callback": None}
    shown = replace(
        report(
            *(path(f"/p{number:02}", 100 - number) for number in range(12)),
            topics=[topic] * 5 if has_topics else (),
            violations=[VIOLATION] * violations,
        ),
        executors=[executor] * 6,
    )
    found = printed(screen.of(shown), console)
    assert len(found) <= height
    assert found[-1].startswith("s: sort by another column")
    if violations:
        assert found[1] == "violations"
        assert "/source → /scan → /filter → /cmd → /sink" in " ".join(found)
    assert sum(line.startswith("/p") for line in found) >= 1
    assert sum(line.startswith("/detector 77") for line in found) >= 1
    assert sum(line.startswith("/t ") for line in found) >= int(has_topics)
    if len(found) < height:
        # Nothing is left out where there is room.
        assert sum(line.startswith("/p") for line in found) == 12
        assert sum(line.startswith("/detector 77") for line in found) == 5


def test_a_high_terminal_shows_more_paths() -> None:
    shown = report(*(path(f"/p{number:02}", 100 - number) for number in range(30)))
    for height, count in ((40, 30), (24, 18)):
        console = terminal(height=height)
        found = printed(WatchScreen(console).of(shown), console)
        assert sum(line.startswith("/p") for line in found) == count
        assert ("and 12 more" in found) == (height == 24)
