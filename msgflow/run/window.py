"""Time window, and points in time as users write them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.run.choice import integer

if TYPE_CHECKING:
    from msgflow.run.choice import Run

MINIMUM_NS = -(2**63)
MAXIMUM_NS = 2**63 - 1
_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
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
            return _recorded_ns(runs, time_ns)
        return _run_start(runs, option) + time_ns
    try:
        return _iso_ns(text)
    except ValueError:
        raise UsageError(
            f"cannot read the time of {option} — {text}",
            f"{option} 2.5 (seconds from the start of the run), {option} 1700000000000000000"
            f" (epoch ns) or {option} 2023-11-14T22:13:20Z",
        ) from None


def known_moments(runs: Sequence[Run]) -> tuple[tuple[int, int], ...]:
    """Return the moments of the only run, (epoch ns, simulated ns); not all simulated are equal."""
    if len(runs) != 1:
        raise UsageError("simulated time is that of one run", "choose one with --run")
    if len({then for _, then in runs[0].simulated}) < 2:
        raise UsageError(
            f"nothing tells the simulated time — {runs[0].title}",
            "record CARET's clock recorder (ros2_caret:sim_time) while the simulation runs",
        )
    return runs[0].simulated


def _recorded_ns(runs: Sequence[Run], simulated_ns: int) -> int:
    """Return when it was so late in the simulation for the first time, epoch ns.

    Its time runs evenly between two moments at which a run knows it. Before the first and after the
    last one it runs as fast as beside them.
    """
    moments = known_moments(runs)
    times = [then for _, then in moments]
    pieces = list(pairwise(moments))
    if min(times) <= simulated_ns <= max(times):
        around = [(a, b) for a, b in pieces if a[1] <= simulated_ns <= b[1]]
    else:
        around = [pieces[0 if simulated_ns < min(times) else -1]]
    # It may have stood still, or begun anew.
    running = [(a, b) for a, b in around if a[1] < b[1]]
    if not running:
        raise UsageError(
            f"the simulation never had this time — {simulated_ns / 1e9:g} s",
            f"its time is known from {min(times) / 1e9:g} s to {max(times) / 1e9:g} s",
        )
    ((begin, end), *_) = running
    return begin[0] + (simulated_ns - begin[1]) * (end[0] - begin[0]) // (end[1] - begin[1])


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
    # Python reads the Z since 3.11.
    moment = datetime.fromisoformat(re.sub(r"Z$", "+00:00", text))
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=timezone.utc)
    return (moment - _EPOCH) // timedelta(seconds=1) * 1_000_000_000 + nanoseconds


def format_epoch(time_ns: int) -> str:
    """Return a point in time as ISO 8601 in UTC with nanoseconds; `--start` reads it, too."""
    seconds, nanoseconds = divmod(time_ns, 1_000_000_000)
    return f"{_second(seconds)}.{nanoseconds:09d}Z"


@lru_cache
def _second(seconds: int) -> str:
    return f"{_EPOCH + timedelta(seconds=seconds):%Y-%m-%dT%H:%M:%S}"
