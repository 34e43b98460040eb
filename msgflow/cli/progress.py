"""Progress bars on stderr: only on a terminal, and never with --quiet."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from msgflow.fleet.ingest import FleetProgress
    from msgflow.ingest import IngestProgress
    from msgflow.trace import Progress as ReadingProgress

_SECONDS_BETWEEN_LINES = 30.0


@contextmanager
def ingest_progress(
    quiet: bool,
) -> Iterator[Callable[[IngestProgress | ReadingProgress], None] | None]:
    """Yield the function that shows how far reading or an ingest is; None without a terminal."""
    if quiet or sys.stderr is None or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[events]:,} events"),
        TextColumn("{task.fields[rate]:,.0f}/s"),
        TimeRemainingColumn(),
    )
    begin = time.monotonic()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("opening", total=None, events=0, rate=0.0)

        def show(progress: IngestProgress | ReadingProgress) -> None:
            # Reading alone has one stage, and its rate is not known there.
            rate = progress.events / max(time.monotonic() - begin, 0.001)
            bar.update(
                task,
                description=getattr(progress, "stage", "reading the traces"),
                total=None if progress.fraction is None else 1.0,
                completed=progress.fraction or 0.0,
                events=progress.events,
                rate=getattr(progress, "events_per_second", rate),
            )

        yield show


@contextmanager
def replay_progress() -> Iterator[Callable[[int, int, str], None]]:
    """Yield the function that shows which replay runs; without a terminal it shows nothing."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (BarColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading the run", total=None)
        yield lambda number, total, text: bar.update(
            task, description=f"replay {number} of {total}: {text}", total=total, completed=number
        )


@contextmanager
def fleet_progress(quiet: bool) -> Iterator[Callable[[FleetProgress], None] | None]:
    """Yield the function that shows how many recordings are done; None with `quiet`.

    Without a terminal it prints a line every half minute, since a fleet takes hours.
    """
    if quiet or sys.stderr is None:
        yield None
        return
    if not sys.stderr.isatty():
        last = time.monotonic()

        def print_line(progress: FleetProgress) -> None:
            nonlocal last
            if time.monotonic() - last >= _SECONDS_BETWEEN_LINES:
                last = time.monotonic()
                print(_fleet_line(progress), file=sys.stderr, flush=True)

        yield print_line
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (BarColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("opening", total=None)

        def show(progress: FleetProgress) -> None:
            line = _fleet_line(progress)
            bar.update(task, description=line, total=progress.total, completed=progress.done)

        yield show


def _fleet_line(progress: FleetProgress) -> str:
    words = [f"{progress.done:,} of {progress.total:,}"]
    troubles = ((progress.failed, "failed"), (progress.retried, "tried again"))
    words += [f"{number:,} {what}" for number, what in troubles if number]
    if progress.worked and progress.seconds:
        words.append(f"{60 * progress.worked / progress.seconds:,.1f}/min")
    if (left := progress.seconds_left) is not None:
        words.append(
            f"some {left / 60:,.0f} min left" if left >= 90 else f"some {left:,.0f} s left"
        )
    words += [f"{worker}: {number:,}" for worker, number in progress.workers.most_common(3)]
    return ", ".join(words)
