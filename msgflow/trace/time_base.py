"""Time base of the traces of one boot.

A tracer measures how far its clock is from the epoch for every trace anew, with buffers per process
for every process. The clock itself is the same for all traces of a boot, as its uuid says: what the
offsets differ by is an error of measuring or, between sessions, what the time of day was set by
meanwhile. An error of measuring is left alone, so that times are those that the trace says and that
every other reader shows. That a clock was set is undone: times of one host have to fit together.
"""

from __future__ import annotations

from typing import Protocol

GIGA = 1_000_000_000
# LTTng reads the two clocks next to each other, several times, and takes the best: some ns, or some
# hundred where reading a clock needs the kernel.
GREATEST_ERROR_NS = 1_000


class DeclaredClock(Protocol):
    """A clock as the metadata of a trace declares it."""

    @property
    def uuid(self) -> str | None:
        """Its uuid."""

    @property
    def name(self) -> str | None:
        """Its name."""

    @property
    def frequency(self) -> int:
        """How often it counts [Hz]."""

    def to_ns(self, value: int) -> int:
        """Return the time of a value of it [ns since the epoch]."""


class TimeBase:
    """The offsets of the clocks of traces that are opened one after the other."""

    def __init__(self) -> None:
        self._offsets: dict[tuple[str, str | None], int] = {}

    def correction_ns(self, clock: DeclaredClock) -> int:
        """Return what to add to the times of a trace [ns], so that they fit those of the first one.

        Only a clock that has a uuid and counts nanoseconds is corrected: without a uuid it is a
        clock of its own.
        """
        if clock.uuid is None or clock.frequency != GIGA:
            return 0
        offset_ns = clock.to_ns(0)
        correction = self._offsets.setdefault((clock.uuid, clock.name), offset_ns) - offset_ns
        return 0 if abs(correction) <= GREATEST_ERROR_NS else correction
