"""The total order of events that happened at the same nanosecond."""

from __future__ import annotations

Entry = tuple[int, int, int]
"""Time in nanoseconds, rank of the stream, number in the order of arrival."""


def new_numbers(groups: list[list[Entry]]) -> dict[int, int]:
    """Number the events of each group by (time, stream, arrival).

    A group is a run of consecutive arrivals whose order is not given by time alone. Arrival
    order within a stream is position in the stream.

    Returns:
        old number to new number, for those that change.
    """
    changed: dict[int, int] = {}
    for group in groups:
        numbers = sorted(entry[2] for entry in group)
        for number, entry in zip(numbers, sorted(group), strict=True):
            if entry[2] != number:
                changed[entry[2]] = number
    return changed
