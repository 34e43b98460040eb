"""Time window, and points in time as users write them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.run.choice import integer
from msgflow.run.simulated import recorded_ns

if TYPE_CHECKING:
    from msgflow.run.choice import Run

MINIMUM_NS = -(2**63)
MAXIMUM_NS = 2**63 - 1
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
# Smaller numbers are seconds: as nanoseconds since the epoch they would lie in the first 12 days of
# 1970. As seconds, this number would be 30 million years.
LEAST_EPOCH_NS = 10**15
_OFFSET = re.compile(
    r"(?P<sign>\+?)(?P<number>\d{1,40}(?:\.\d{1,40})?)(?P<unit>ns|us|µs|ms|s|min|h|d)?"
)
_UNIT_NS = {
    "ns": 1,
    "us": 1_000,
    "µs": 1_000,
    "ms": 1_000_000,
    "s": 1_000_000_000,
    "min": 60_000_000_000,
    "h": 3_600_000_000_000,
    "d": 86_400_000_000_000,
}
_FRACTION = re.compile(r"(?P<head>.*:\d\d)\.(?P<fraction>\d{1,9})(?P<tail>.*)")


@dataclass(frozen=True)
class Window:
    """A time window."""

    start_ns: int = MINIMUM_NS  # its begin, epoch ns
    end_ns: int = MAXIMUM_NS  # its end, epoch ns, exclusive

    @property
    def bindings(self) -> dict[str, int]:
        """The parameters $start_ns and $end_ns of a statement."""
        return {"start_ns": self.start_ns, "end_ns": self.end_ns}


WHOLE = Window()
"""The window without limits."""


def time_point(text: str | int, runs: Sequence[Run], option: str) -> int:
    """Return a point in time in epoch ns.

    `text` is an offset from the start of the only run ('2.5' seconds, '100ms'), a time of its
    simulation ('sim:2.5'), an ISO time, or epoch ns: an integer, or a text of 16 digits or more.
    """
    time_ns = _read(text, runs, option)
    if not MINIMUM_NS <= time_ns <= MAXIMUM_NS:
        raise UsageError(
            f"the time of {option} is out of range — {text}", "times reach from 1677 to 2262"
        )
    return time_ns


def duration_ns(text: str, option: str, *, least_ns: int = 1) -> int:
    """Return the nanoseconds of a duration such as '10s', '500ms' or '2' (seconds)."""
    found = _OFFSET.fullmatch(text.strip())
    length = _to_ns(found["number"], found["unit"] or "s") if found else -1
    if length < least_ns:
        raise UsageError(f"cannot read the duration of {option} — {text}", f"{option} 2.5s")
    return length


def _read(text: str | int, runs: Sequence[Run], option: str) -> int:
    if isinstance(text, int):
        return text
    text = text.strip()
    if (time_ns := integer(text)) is not None and abs(time_ns) >= LEAST_EPOCH_NS:
        return time_ns
    if offset := _OFFSET.fullmatch(text.removeprefix("sim:")):
        time_ns = _to_ns(offset["number"], offset["unit"] or "s")
        if text.startswith("sim:"):
            return recorded_ns(runs, time_ns)
        return _run_start(runs, option) + time_ns
    try:
        return _iso_ns(text)
    except ValueError:
        raise UsageError(
            f"cannot read the time of {option} — {text}",
            f"{option} 2.5 (seconds from the start of the run), {option} 1700000000000000000"
            f" (epoch ns) or {option} 2023-11-14T22:13:20Z",
        ) from None


def _run_start(runs: Sequence[Run], option: str) -> int:
    if len(runs) != 1:
        raise UsageError(
            f"{option} counts from the start of a run, but {len(runs)} are chosen",
            "choose one with --run, or give epoch ns or ISO times",
        )
    if runs[0].start_ns is None:
        raise UsageError(
            f"{option} counts from the start of a run, which has no events",
            "give epoch ns or ISO times",
        )
    return runs[0].start_ns


def _to_ns(number: str, unit: str) -> int:
    whole, _, fraction = number.partition(".")
    scale = _UNIT_NS[unit]
    return int(whole) * scale + (int(fraction) * scale // 10 ** len(fraction) if fraction else 0)


def _iso_ns(text: str) -> int:
    # datetime keeps microseconds only: we take the fraction off before, and add it afterwards.
    nanoseconds = 0
    if match := _FRACTION.fullmatch(text):
        nanoseconds = int(match["fraction"].ljust(9, "0"))
        text = match["head"] + match["tail"]
    moment = datetime.fromisoformat(text)
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    return (moment - _EPOCH) // timedelta(seconds=1) * 1_000_000_000 + nanoseconds


def format_epoch(time_ns: int) -> str:
    """Return a point in time as ISO 8601 in UTC with nanoseconds; `--start` reads it, too."""
    seconds, nanoseconds = divmod(time_ns, 1_000_000_000)
    return f"{_second(seconds)}.{nanoseconds:09d}Z"


@lru_cache
def _second(seconds: int) -> str:
    return f"{_EPOCH + timedelta(seconds=seconds):%Y-%m-%dT%H:%M:%S}"
