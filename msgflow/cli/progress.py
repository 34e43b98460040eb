"""Progress on stderr, for people who watch: never in a pipe, never with --quiet."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from msgflow.ingest import IngestProgress


@contextmanager
def ingest_progress(quiet: bool) -> Iterator[Callable[[IngestProgress], None] | None]:
    """Yield the function that shows the progress of an ingest, or None where nobody looks."""
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

        def show(progress: IngestProgress) -> None:
            fraction = progress.fraction
            bar.update(
                task,
                description=progress.stage,
                total=None if fraction is None else 1.0,
                completed=0.0 if fraction is None else fraction,
                events=progress.events,
                rate=progress.events_per_second,
            )

        yield show
