"""One time base for the traces of one boot.

A tracer measures how far its clock is from the epoch for every trace anew, with buffers per process
for every process. The clock itself is the same for all traces of a boot, as its uuid says: what the
offsets differ by is an error of measuring or, between sessions, what the time of day was set by
meanwhile. An error of measuring is left alone, so that times are those that the trace says and that
every other reader shows. That a clock was set is undone: times of one host have to fit together.
"""

from __future__ import annotations

GIGA = 1_000_000_000
# LTTng reads the two clocks next to each other, several times, and takes the best: some ns, or some
# hundred where reading a clock needs the kernel.
GREATEST_ERROR_NS = 1_000


class TimeBase:
    """The offsets of the clocks of traces that are opened one after the other."""

    def __init__(self) -> None:
        self._offsets: dict[tuple[str, str | None], int] = {}

    def correction_ns(
        self, uuid: str | None, name: str | None, frequency: int, offset_ns: int
    ) -> int:
        """Return what to add to the times of a trace, so that they fit those of the first one.

        Args:
            uuid: of the trace's clock, or None, which is a clock of its own.
            name: of the clock, or None.
            frequency: of the clock [Hz]; only clocks that count nanoseconds are corrected.
            offset_ns: what the trace says that its clock is ahead of the epoch.
        """
        if uuid is None or frequency != GIGA:
            return 0
        correction = self._offsets.setdefault((uuid, name), offset_ns) - offset_ns
        return 0 if abs(correction) <= GREATEST_ERROR_NS else correction
