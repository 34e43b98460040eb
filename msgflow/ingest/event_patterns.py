"""Patterns of event names, such as 'dds:*'."""

from __future__ import annotations

import fnmatch
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence


def is_match(name: str, patterns: Sequence[str]) -> bool:
    """Tell whether a name of events matches one of the patterns."""
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def matches(
    patterns: Sequence[str], counts: Mapping[tuple[int, str], int]
) -> Iterator[tuple[int, str, str | None]]:
    """Yield (place, pattern, event) for each event that a pattern matches, else with None."""
    occurred = sorted({name for (_, name), count in counts.items() if count})
    for place, pattern in enumerate(dict.fromkeys(patterns)):
        found = [name for name in occurred if is_match(name, [pattern])]
        yield from ((place, pattern, name) for name in found or (None,))
