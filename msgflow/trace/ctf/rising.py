"""Which of some numbers that should never fall are wrong."""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def misplaced(values: Sequence[int]) -> set[int]:
    """Return the places to leave out so that the rest never falls, as few as possible."""
    ends: list[int] = []
    places_of_ends: list[int] = []
    previous: list[int] = []
    for place, value in enumerate(values):
        # The longest series that this value can end.
        length = bisect_right(ends, value)
        previous.append(places_of_ends[length - 1] if length else -1)
        if length == len(ends):
            ends.append(value)
            places_of_ends.append(place)
        else:
            ends[length] = value
            places_of_ends[length] = place
    kept = set()
    place = places_of_ends[-1] if places_of_ends else -1
    while place >= 0:
        kept.add(place)
        place = previous[place]
    return set(range(len(values))) - kept
