"""Which events an ingest leaves out on request."""

from __future__ import annotations

import fnmatch
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence


def is_ignored(name: str, patterns: Sequence[str]) -> bool:
    """Tell whether a name of events matches one of the patterns, such as 'dds:*'."""
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def matches(
    patterns: Sequence[str], counts: Mapping[tuple[int, str], int]
) -> Iterator[tuple[int, str, str | None]]:
    """Yield place and name of each pattern with each event that it matches, None if there is none.

    Args:
        patterns: of the names to leave out.
        counts: (trace index, event name) -> events that occurred.
    """
    occurred = sorted({name for (_, name), count in counts.items() if count})
    for place, pattern in enumerate(dict.fromkeys(patterns)):
        matching = [name for name in occurred if is_ignored(name, [pattern])]
        yield from ((place, pattern, name) for name in matching or (None,))
