"""What `msgflow watch` shows: a screen, the worst first as in `top`, or a line for each window."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from threading import Lock
from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from msgflow.cli.show.keys import noted_keys
from msgflow.run.window import format_epoch
from msgflow.text.values import NULL, count, format_duration, printable
from msgflow.watch.alarm import violation_line
from msgflow.watch.silences import silence_line

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from msgflow.watch.window_report import WindowReport

Row = dict[str, Any]

# Of format_epoch: hours to seconds, and to milliseconds in a line for logs.
_TIME = slice(11, 19)
_TIME_OF_LINE = slice(11, 23)
_SPARKS = "▁▂▃▄▅▆▇█"
_STEPS = 10
_THREADS, _TOPICS, _VIOLATIONS = 5, 5, 5
# Violations before the last one have no more than this part of the screen.
_PART_OF_VIOLATIONS = 3
_PATH_WIDTH, _CALLBACK_WIDTH, _REASON_WIDTH = 26, 27, 14
_MISSING = ("dropped", "lost", "no_output", "unknown")
_MISSED = ("dropped", "lost")
_FATES = ("reached", "superseded", *_MISSING, "not_connected", "cut_by_recording")
# By the title of the column that they sort by; what is worst comes first.
_ORDERS: dict[str, Callable[[Row], Any]] = {
    "missing": lambda path: (-missing(path), -(path["max_ns"] or 0)),
    "max": lambda path: -(path["max_ns"] or 0),
    "p99": lambda path: -(path["p99_ns"] or 0),
    "median": lambda path: -(path["median_ns"] or 0),
    "/s": lambda path: path["reached"],
    "path": lambda path: path["path"],
}
_KEYS = "s: sort by another column   ↑ ↓: pick a path   Ctrl-C: end"


class WatchScreen:
    """The last window, with what came before as sparklines.

    It is as high as the terminal at most: violations come first, and tables share what is left.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._slowest: dict[str, deque[int]] = {}
        self._violations: deque[str] = deque(maxlen=_VIOLATIONS)
        self._order = "missing"
        self._picked: str | None = None
        self._report: WindowReport | None = None
        # Keys come from another thread than windows.
        self._lock = Lock()

    def of(self, report: WindowReport) -> RenderableType:
        """Return the screen after a further window."""
        with self._lock:
            self._take_in(report)
            return self._shown(report)

    def after_key(self, key: str) -> RenderableType | None:
        """Return the screen after a key; None if nothing changes."""
        with self._lock:
            if self._report is None:
                return None
            if key == "s":
                orders = list(_ORDERS)
                self._order = orders[(orders.index(self._order) + 1) % len(orders)]
            elif key in ("up", "down"):
                self._pick(1 if key == "down" else -1)
            elif key == "escape":
                self._picked = None
            else:
                return None
            return self._shown(self._report)

    def _pick(self, step: int) -> None:
        assert self._report is not None
        names = [path["path"] for path in self._sorted(self._report)]
        if not names:
            return
        place = names.index(self._picked) + step if self._picked in names else 0
        self._picked = names[min(max(place, 0), len(names) - 1)]

    def _sorted(self, report: WindowReport) -> list[Row]:
        return sorted(report.paths, key=_ORDERS[self._order])

    def _take_in(self, report: WindowReport) -> None:
        self._report = report
        for path in report.paths:
            steps = self._slowest.setdefault(path["path"], deque(maxlen=_STEPS))
            # Clocks that are apart make latencies negative.
            steps.append(max(path["max_ns"] or 0, 0))
        at = format_epoch(report.window.end_ns)[_TIME]
        told = [*map(violation_line, report.violations), *map(silence_line, report.stopped)]
        self._violations += [f"{at} {line}" for line in told]

    def _shown(self, report: WindowReport) -> RenderableType:
        fates = [_fates(path) for path in report.paths if path["path"] == self._picked]
        above = [_heading(report), *self._shown_violations(), *fates]
        keys = Text(_KEYS, style="dim")
        room = self._console.height - sum(self._height(part) for part in (*above, keys))
        # Each table has a line of titles.
        room -= 3 if report.topics else 2
        threads, topics = min(len(report.executors), _THREADS), min(len(report.topics), _TOPICS)
        paths = _share(room, len(report.paths), threads + topics)
        topics = _share(room - paths, topics, threads)
        threads = _share(room - paths - topics, threads, 0)
        tables = [self._paths(report, paths), _threads(report, threads)]
        if report.topics:
            tables.append(_topics(report, topics))
        return Group(*above, *tables, keys)

    def _height(self, text: Text) -> int:
        return len(text.wrap(self._console, self._console.width))

    def _shown_violations(self) -> list[Text]:
        """Return the last violation, and those before it that there is room for."""
        lines = [Text(printable(line), style="red") for line in self._violations]
        room = self._console.height // _PART_OF_VIOLATIONS
        shown: list[Text] = []
        for line in reversed(lines):
            room -= self._height(line)
            if shown and room < 0:
                break
            shown.append(line)
        return [Text("violations", style="bold red"), *reversed(shown)] if shown else []

    def _paths(self, report: WindowReport, rows: int) -> Table:
        seconds = (report.window.end_ns - report.window.start_ns) / 1_000_000_000
        titles = ("path", "/s", "median", "p99", "max", "missing", "steps")
        table = _table(*(f"{name}▾" if name == self._order else name for name in titles))
        ordered = self._sorted(report)
        if len(ordered) > rows:
            # The last row tells how many there are besides.
            rows = max(rows - 1, 0)
        places = [place for place, path in enumerate(ordered) if path["path"] == self._picked]
        # The one that is picked is seen.
        first = max([0, *(place - rows + 1 for place in places)])
        for path in ordered[first : first + rows]:
            lost = missing(path)
            table.add_row(
                _short(path["path"], _PATH_WIDTH),
                f"{path['reached'] / seconds:.0f}",
                *(
                    _duration(path[name]) + "?" * bool(path["ambiguous"])
                    for name in ("median_ns", "p99_ns", "max_ns")
                ),
                Text(str(lost), style="bold red" if lost else ""),
                _sparkline(self._slowest[path["path"]]),
                style="reverse" if path["path"] == self._picked else "",
            )
        if (more := len(ordered) - rows) > 0:
            table.add_row(f"and {more} more")
        return table


def show_screen(reports: Iterable[WindowReport]) -> None:
    """Show window after window on the terminal; the last one stays."""
    with Live(Text("waiting for the first window"), auto_refresh=False) as live:
        screen = WatchScreen(live.console)

        def pressed(key: str) -> None:
            if (shown := screen.after_key(key)) is not None:
                live.update(shown, refresh=True)

        with noted_keys(pressed):
            for report in reports:
                live.update(screen.of(report), refresh=True)


def missing(path: Row) -> int:
    """Return how many flows of a path did not arrive, though they should have."""
    return sum(path[name] for name in _MISSING)


def _heading(report: WindowReport) -> Text:
    start, end = (format_epoch(at)[_TIME] for at in report.window.bindings.values())
    text = Text(f"{start} to {end}", style="bold")
    text.append(f"   {count(len(report.paths), 'path')}", style="not bold")
    if report.lag_s is not None:
        text.append(f"   lag {report.lag_s:.1f} s", style="not bold")
    if report.verdicts:
        text.append(f"   targets: {_verdict_words(report)}", style="not bold")
    lost = report.discarded_events
    said = f"{count(lost, 'event')} lost by the tracer"
    text.append(f"   {said}", style="red" if lost else "not bold dim")
    if report.late_events:
        text.append(f"   {count(report.late_events, 'event')} came late", style="red")
    return text


def _counts(row: Row) -> str:
    return ", ".join(f"{reason} {number}" for reason, number in (row["reasons"] or {}).items())


def _fates(path: Row) -> Text:
    counts = ", ".join(f"{path[name]:,} {name.replace('_', ' ')}" for name in _FATES if path[name])
    text = Text(printable(path["path"]), style="bold")
    reasons = f" ({_counts(path)})" if path["reasons"] else ""
    doubt = f"; {path['ambiguous']:,} pass a link that may be another one" * bool(path["ambiguous"])
    text.append(
        "\n" + printable(f"{path['roots']:,} flows: {counts or 'none'}{reasons}{doubt}"),
        style="not bold",
    )
    return text


def _share(room: int, wanted: int, others: int) -> int:
    """Return how many rows a table has: half of the room at least, more if others need less."""
    return max(min(wanted, max(room - others, room // 2)), 0)


def _threads(report: WindowReport, rows: int) -> Table:
    table = _table("thread", "busy", "blocked", "longest")
    table.add_column("callback", no_wrap=True)
    for row in report.executors[:rows]:
        table.add_row(
            _short(f"{row['nodes']} {row['tid']}", _PATH_WIDTH),
            f"{100 * (row['callback_share'] or 0):.0f} %",
            _duration(row["blocked_ns"]),
            _duration(row["longest_ns"]),
            _short(row["longest_callback"] or NULL, _CALLBACK_WIDTH),
        )
    return table


def _topics(report: WindowReport, most: int) -> Table:
    """Return topics: first those that lost messages, then those with the oldest data."""
    table = _table("topic", "/s", "jitter", "age", "dropped", "lost", "why")
    rows = sorted(
        report.topics,
        key=lambda row: (-(row["dropped"] + row["lost"]), -(row["latency_p95_ns"] or 0)),
    )
    for row in rows[:most]:
        missed = (Text(str(row[name]), "bold red" * bool(row[name])) for name in _MISSED)
        table.add_row(
            _short(row["topic"] or NULL, _PATH_WIDTH),
            f"{row['rate_hz'] or 0:.0f}",
            _duration(row["period_deviation_ns"]),
            _duration(row["latency_p95_ns"]),
            *missed,
            _short(_counts(row), _REASON_WIDTH),
        )
    return table


def _table(first: str, *others: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", show_edge=False)
    table.add_column(first, no_wrap=True)
    for title in others:
        table.add_column(title, justify="right", no_wrap=True)
    return table


def _duration(value: int | None) -> str:
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


def window_line(report: WindowReport) -> str:
    """Return what matters most in a window."""
    start, end = (format_epoch(at)[_TIME_OF_LINE] for at in report.window.bindings.values())
    roots = sum(path["roots"] for path in report.paths)
    reached = sum(path["reached"] for path in report.paths)
    words = [count(len(report.paths), "path"), f"{reached:,} of {roots:,} flows arrived"]
    slow = max(report.paths, key=lambda path: path["max_ns"] or 0, default=None)
    if slow is not None and slow["max_ns"] is not None:
        words.append(f"slowest {format_duration(slow['max_ns'])} on {printable(slow['path'])}")
    lost = sum(loss["dropped"] + loss["lost"] for loss in report.losses)
    if lost:
        words.append(f"{count(lost, 'message')} dropped or lost")
    if report.discarded_events:
        words.append(f"{count(report.discarded_events, 'event')} lost by the tracer")
    if report.late_events:
        words.append(f"{count(report.late_events, 'event')} came late")
    if report.verdicts:
        words.append(f"targets: {_verdict_words(report)}")
    if report.lag_s is not None:
        words.append(f"lag {report.lag_s:.1f} s")
    return f"{start} to {end}: {', '.join(words)}"


def _verdict_words(report: WindowReport) -> str:
    return ", ".join(f"{number} {verdict}" for verdict, number in sorted(report.verdicts.items()))
