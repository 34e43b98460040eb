"""The screen of `msgflow watch`."""

from __future__ import annotations

import io

from rich.console import Console

from msgflow.cli.show.watch_screen import WatchScreen
from msgflow.run.window import Window
from msgflow.watch import WindowReport


def test_names_are_text_and_all_fits() -> None:
    """A program may call itself what it likes: no markup, no control characters."""
    fates = {"dropped": 0, "lost": 0, "no_output": 0, "unknown": 3}
    times = {"median_ns": 1_000_000, "p99_ns": 2_000_000, "max_ns": 2_000_000}
    thread = {"process": "[/x] \x1b[31m", "tid": 7, "callback_share": 0.5, "callback_ns": 10}
    loss = {"topic": "[/y]", "subscriber": "/s" * 40, "dropped": 4, "lost": 0, "reasons": None}
    report = WindowReport(
        window=Window(0, 2_000_000_000),
        is_final=True,
        paths=[{"path": "[/z] → \x1b[2J", "reached": 20, **fates, **times}],
        executors=[{**thread, "blocked_ns": 0, "callbacks": 3}],
        losses=[loss],
        discarded_events=0,
        longest_ns=0,
    )
    out = io.StringIO()
    Console(file=out, width=80).print(WatchScreen().of(report))
    shown = out.getvalue()
    assert all(name in shown for name in ("[/x]", "[/y]", "[/z]"))
    assert "\x1b" not in shown
    assert max(map(len, shown.splitlines())) <= 80
