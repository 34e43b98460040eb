"""Slice of a database: which runs are read, and between which times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypedDict

from msgflow.errors import UsageError
from msgflow.run.choice import Run, choose_one, choose_runs, read_runs
from msgflow.run.window import Window, time_point

if TYPE_CHECKING:
    import duckdb


class TimeWords(TypedDict, total=False):
    """The times of a slice, as keywords of a method."""

    start: str | int | None
    end: str | int | None


class SliceWords(TypedDict, total=False):
    """A slice, as keywords of a method."""

    run: str | int | None
    start: str | int | None
    end: str | int | None


@dataclass(frozen=True)
class Slice:
    """Which runs are read, and between which times, as a user says it.

    Times are an offset from the start of the run ('2.5' in seconds, '100ms'), an ISO time,
    nanoseconds since the epoch (an integer, or a text of 16 digits or more), or seconds of a
    simulation ('sim:12.5'). Offsets need exactly one run.

    Attributes:
        run: a name, an id, a label KEY=VALUE of several runs, or 'all'; the latest run when None.
        start: begin of the time window; no limit when None. '2s' leaves out a warm-up.
        end: its end, exclusive; no limit when None.
    """

    run: str | int | None = None
    start: str | int | None = None
    end: str | int | None = None

    @property
    def has_window(self) -> bool:
        """Whether it limits the time."""
        return self.start is not None or self.end is not None

    def runs(self, connection: duckdb.DuckDBPyConnection) -> tuple[Run, ...]:
        """Return the runs, none if the database holds none."""
        return choose_runs(read_runs(connection), self.run)

    def one_run(self, connection: duckdb.DuckDBPyConnection, what: str) -> Run:
        """Return the only run, for something that reads one, such as 'a graph'."""
        return choose_one(read_runs(connection), self.run, what)

    def window(self, runs: Sequence[Run]) -> Window:
        """Return the time window of these runs, without limits if none are given."""
        limits = {}
        if self.start is not None:
            limits["start_ns"] = time_point(self.start, runs, "--start")
        if self.end is not None:
            limits["end_ns"] = time_point(self.end, runs, "--end")
        window = Window(**limits)
        if window.start_ns > window.end_ns:
            raise UsageError(
                f"the window ends before it starts — {window.start_ns} to {window.end_ns} ns",
                "give an --end that is later than the start",
            )
        return window


LATEST = Slice()
"""All of the latest run."""
