"""Splits packets where events seem to begin, so that large ones are scanned as fast as many.

Whether an event begins there is only guessed. A scan of the lane before tells: it comes to that
byte exactly, or the guess was wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from msgflow.trace.ctf.layout import Span
    from msgflow.trace.ctf.steps import Steps

# Lanes that take steps together: more are hardly faster, and each costs a guess.
_MOST = 512
_SMALLEST = 4 << 10
# Bytes at which a begin is looked for, and how far events must follow each other from there.
_LOOKED_AT = 128
_FOLLOWED = 512


@dataclass(frozen=True)
class Lanes:
    """Stretches of packets, in the order of memory, without gaps.

    Attributes:
        spans: which packet each belongs to.
        begins: where it begins, in bytes of memory; a guess unless the packet begins there.
        ends: where the next one begins, or the packet ends.
    """

    spans: NDArray[np.int64]
    begins: NDArray[np.int64]
    ends: NDArray[np.int64]


def split(steps: Steps, spans: Sequence[Span], align: int) -> Lanes:
    """Split packets, those without events left out.

    Args:
        steps: sizes of their events.
        spans: the packets, in the order of memory.
        align: of event headers, in bytes.
    """
    limits = np.array([(span.begin, span.end) for span in spans], np.int64).reshape(-1, 2)
    numbers = np.flatnonzero(limits[:, 0] < limits[:, 1])
    if not numbers.size:
        return Lanes(numbers, numbers, numbers)
    first, end = limits[numbers].T
    size = max(_SMALLEST, int((end - first).sum()) // _MOST)
    # What is looked at lies within the packet.
    counts = np.maximum((end - first - _LOOKED_AT - _FOLLOWED) // size, 0)
    owners = np.repeat(np.arange(numbers.size), counts)
    places = np.arange(owners.size) - np.repeat(np.cumsum(counts) - counts, counts) + 1
    guesses, of_guesses = _guess(steps, (first[owners] + places * size) & -align, align)
    owners = owners[of_guesses]
    good = (guesses > first[owners]) & (guesses < end[owners])
    begins = np.concatenate([first, guesses[good]])
    owners = np.concatenate([np.arange(numbers.size), owners[good]])
    begins, kept = np.unique(begins, return_index=True)
    owners = owners[kept]
    ends = np.append(begins[1:], 0)
    is_last = np.append(owners[1:] != owners[:-1], True)
    ends[is_last] = end[owners[is_last]]
    return Lanes(numbers[owners], begins, ends)


def _guess(
    steps: Steps, targets: NDArray[np.int64], align: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where events seem to begin behind these bytes, and behind which of them each is.

    From wherever one starts, steps soon lead to the begin of an event, and from there on only to
    begins; what leads to no event was none. So most of those who get far enough meet.
    """
    offsets = np.arange(0, _LOOKED_AT, align)
    at = (targets[:, np.newaxis] + offsets).reshape(-1)
    owners = np.repeat(np.arange(targets.size), offsets.size)
    goals = targets + (_LOOKED_AT + _FOLLOWED)
    arrived, of_arrived = [], []
    while at.size:
        sizes = steps.sizes(at)
        going = np.flatnonzero(sizes)
        at, owners = at[going] + sizes[going], owners[going]
        is_there = at >= goals[owners]
        arrived.append(at[is_there])
        of_arrived.append(owners[is_there])
        at, owners = at[~is_there], owners[~is_there]
    ends = np.concatenate([*arrived, np.empty(0, np.int64)])
    of_ends = np.concatenate([*of_arrived, np.empty(0, np.int64)])
    order = np.lexsort((ends, of_ends))
    counts = np.bincount(of_ends, minlength=targets.size)
    found = np.flatnonzero(counts)
    middle = (np.cumsum(counts) - counts + counts // 2)[found]
    return ends[order[middle]], found
