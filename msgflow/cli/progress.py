"""Progress on stderr, for people who watch: never in a pipe, never with --quiet."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from msgflow.ingest import IngestProgress
    from msgflow.trace import Progress as ReadingProgress


class _Bar(Protocol):
    def __call__(self, stage: str, events: int, fraction: float | None, rate: float) -> None: ...


@contextmanager
def ingest_progress(quiet: bool) -> Iterator[Callable[[IngestProgress], None] | None]:
    """Yield the function that shows the progress of an ingest, or None where nobody looks."""
    with _bar(quiet) as bar:
        if bar is None:
            yield None
            return

        def show(progress: IngestProgress) -> None:
            bar(progress.stage, progress.events, progress.fraction, progress.events_per_second)

        yield show


@contextmanager
def reading_progress() -> Iterator[Callable[[ReadingProgress], None] | None]:
    """Yield the function that shows the progress of reading, or None where nobody looks."""
    begin = time.monotonic()
    with _bar(quiet=False) as bar:
        if bar is None:
            yield None
            return

        def show(progress: ReadingProgress) -> None:
            seconds = time.monotonic() - begin
            rate = progress.events / seconds if seconds > 0 else 0.0
            bar("reading the traces", progress.events, progress.fraction, rate)

        yield show


@contextmanager
def _bar(quiet: bool) -> Iterator[_Bar | None]:
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
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("opening", total=None, events=0, rate=0.0)

        def show(stage: str, events: int, fraction: float | None, rate: float) -> None:
            bar.update(
                task,
                description=stage,
                total=None if fraction is None else 1.0,
                completed=0.0 if fraction is None else fraction,
                events=events,
                rate=rate,
            )

        yield show
