"""Slice of a database: which runs are read, and between which times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypedDict

from msgflow.errors import UsageError
from msgflow.run.choice import Run, choose_one, choose_runs, read_runs
from msgflow.run.window import Window, time_point

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb


class TimeWords(TypedDict, total=False):
    """The times of a slice, as keywords of a method."""

    start: str | int | None
    end: str | int | None


class RunWords(TypedDict, total=False):
    """The runs of a slice, as a keyword of a method."""

    run: str | int | None


class SliceWords(RunWords, TimeWords, total=False):
    """A slice, as keywords of a method."""


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
        """Return the runs, none if the database holds none.

        Raises:
            UsageError: no such run, or a name that several runs have.
        """
        return choose_runs(read_runs(connection), self.run)

    def one_run(self, connection: duckdb.DuckDBPyConnection, what: str) -> Run:
        """Return the only run, for something that reads one run.

        Args:
            connection: to a database with the public views.
            what: that something for messages, such as 'a graph'.

        Raises:
            UsageError: no such run, no run at all, or several.
        """
        return choose_one(read_runs(connection), self.run, what)

    def window(self, runs: Sequence[Run]) -> Window:
        """Return the time window, without limits if none are given.

        Args:
            runs: the runs of the slice.

        Raises:
            UsageError: a time that cannot be read or is out of range, or an empty window.
        """
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
