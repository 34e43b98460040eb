"""A window in one line, for logs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.run.window import format_epoch
from msgflow.text.values import count, format_duration, printable

if TYPE_CHECKING:
    from msgflow.watch.window_report import WindowReport

# Of format_epoch: hours to milliseconds.
_TIME = slice(11, 23)


def window_line(report: WindowReport) -> str:
    """Return what matters most in a window."""
    start, end = (format_epoch(at)[_TIME] for at in report.window.bindings.values())
    roots = sum(path["roots"] for path in report.paths)
    reached = sum(path["reached"] for path in report.paths)
    words = [count(len(report.paths), "path"), f"{reached:,} of {roots:,} flows arrived"]
    slow = max(report.paths, key=lambda path: path["max_ns"] or 0, default=None)
    if slow is not None and slow["max_ns"] is not None:
        words.append(f"slowest {format_duration(slow['max_ns'])} on {printable(slow['path'])}")
    missing = sum(loss["dropped"] + loss["lost"] for loss in report.losses)
    if missing:
        words.append(f"{count(missing, 'message')} dropped or lost")
    if report.discarded_events:
        words.append(f"{count(report.discarded_events, 'event')} lost by the tracer")
    if report.late_events:
        words.append(f"{count(report.late_events, 'event')} came late")
    if report.verdicts:
        words.append(f"targets: {verdict_words(report)}")
    if report.lag_s is not None:
        words.append(f"lag {report.lag_s:.1f} s")
    return f"{start} to {end}: {', '.join(words)}"


def verdict_words(report: WindowReport) -> str:
    """Return how many verdicts on targets there are of each kind."""
    return ", ".join(f"{number} {verdict}" for verdict, number in sorted(report.verdicts.items()))
