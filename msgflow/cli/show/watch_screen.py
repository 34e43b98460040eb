"""The screen of `msgflow watch`: what is worst stands first, as in `top`."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from msgflow.cli.show.window_line import verdict_words
from msgflow.run.window import format_epoch
from msgflow.text.values import NULL, format_duration, printable
from msgflow.watch import violation_line

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rich.console import RenderableType

    from msgflow.watch import WindowReport

Row = dict[str, Any]

# Of format_epoch: hours to seconds.
_TIME = slice(11, 19)
_SPARKS = "▁▂▃▄▅▆▇█"
_STEPS = 10
_PATHS, _THREADS, _LOSSES, _VIOLATIONS = 12, 5, 5, 5
_PATH_WIDTH, _NAME_WIDTH = 26, 40
_MISSING = ("dropped", "lost", "no_output", "unknown")


class WatchScreen:
    """The last window, with what came before as sparklines."""

    def __init__(self) -> None:
        """Start before the first window."""
        self._slowest: dict[str, deque[int]] = {}
        self._violations: deque[str] = deque(maxlen=_VIOLATIONS)

    def of(self, report: WindowReport) -> RenderableType:
        """Return the screen after a further window."""
        for path in report.paths:
            steps = self._slowest.setdefault(path["path"], deque(maxlen=_STEPS))
            # Clocks that are apart make latencies negative.
            steps.append(max(path["max_ns"] or 0, 0))
        at = format_epoch(report.window.end_ns)[_TIME]
        self._violations += [f"{at} {violation_line(each)}" for each in report.violations]
        parts: list[RenderableType] = [_heading(report), self._paths(report), _threads(report)]
        if report.losses:
            parts.append(_losses(report))
        if self._violations:
            parts.append(Text("violations", style="bold red"))
            parts += [Text(printable(line), style="red") for line in self._violations]
        return Group(*parts)

    def _paths(self, report: WindowReport) -> Table:
        seconds = (report.window.end_ns - report.window.start_ns) / 1_000_000_000
        table = _table("path", "/s", "median", "p99", "max", "missing", "steps")
        worst = sorted(report.paths, key=lambda path: (-missing(path), -(path["max_ns"] or 0)))
        for path in worst[:_PATHS]:
            lost = missing(path)
            table.add_row(
                _short(path["path"], _PATH_WIDTH),
                f"{path['reached'] / seconds:.0f}",
                *(_duration(path[name]) for name in ("median_ns", "p99_ns", "max_ns")),
                Text(str(lost), style="bold red" if lost else ""),
                _sparkline(self._slowest[path["path"]]),
            )
        if (more := len(worst) - _PATHS) > 0:
            table.add_row(f"and {more} more")
        return table


def show_screen(reports: Iterable[WindowReport]) -> None:
    """Show window after window on the terminal; the last one stays."""
    screen = WatchScreen()
    with Live(Text("waiting for the first window"), auto_refresh=False) as live:
        for report in reports:
            live.update(screen.of(report), refresh=True)


def missing(path: Row) -> int:
    """Return how many flows of a path did not arrive, though they should have."""
    return sum(path[name] for name in _MISSING)


def _heading(report: WindowReport) -> Text:
    start, end = (format_epoch(at)[_TIME] for at in report.window.bindings.values())
    text = Text(f"{start} to {end}", style="bold")
    text.append(f"   {len(report.paths)} paths", style="not bold")
    if report.lag_s is not None:
        text.append(f"   lag {report.lag_s:.1f} s", style="not bold")
    if report.verdicts:
        text.append(f"   targets: {verdict_words(report)}", style="not bold")
    lost = report.discarded_events
    text.append(f"   {lost:,} events lost by the tracer", style="red" if lost else "not bold dim")
    return text


def _threads(report: WindowReport) -> Table:
    table = _table("thread", "busy", "in callbacks", "blocked", "callbacks")
    for row in report.executors[:_THREADS]:
        table.add_row(
            _short(f"{row['process']} {row['tid']}", _NAME_WIDTH),
            f"{100 * (row['callback_share'] or 0):.0f} %",
            _duration(row["callback_ns"]),
            _duration(row["blocked_ns"]),
            str(row["callbacks"]),
        )
    return table


def _losses(report: WindowReport) -> Table:
    table = _table("topic", "dropped", "lost", "why")
    rows = sorted(report.losses, key=lambda row: -(row["dropped"] + row["lost"]))
    for row in rows[:_LOSSES]:
        place = f"{row['topic']} → {row['subscriber']}"
        reasons = _short(row["reasons"] or "", _PATH_WIDTH)
        table.add_row(_short(place, _PATH_WIDTH), str(row["dropped"]), str(row["lost"]), reasons)
    return table


def _table(first: str, *others: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", show_edge=False)
    table.add_column(first, no_wrap=True)
    for title in others:
        table.add_column(title, justify="right", no_wrap=True)
    return table


def _duration(value: int | None) -> str:
    """Return a duration with three digits."""
    if value is None:
        return NULL
    number, unit = format_duration(value).split(" ")
    return f"{float(number):.3g} {unit}" if float(number) < 1_000 else f"{number} {unit}"


def _sparkline(values: deque[int]) -> str:
    most = max(values) or 1
    return "".join(_SPARKS[value * (len(_SPARKS) - 1) // most] for value in values)


def _short(text: str, width: int) -> Text:
    """Return a text that fits, without its middle if it is too long; no markup is read from it."""
    text = printable(text)
    if len(text) > width:
        half = (width - 1) // 2
        text = f"{text[: width - 1 - half]}…{text[-half:]}"
    return Text(text)
