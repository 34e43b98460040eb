"""What an ingest left out on request, told as diagnostics, so that nobody looks for it later."""

from __future__ import annotations

import fnmatch
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence


def is_ignored(name: str, patterns: Sequence[str]) -> bool:
    """Tell whether a name of events matches one of the patterns, such as 'dds:*'."""
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def diagnostics(
    patterns: Sequence[str], counts: Mapping[tuple[int, str], int]
) -> Iterator[tuple[str, str, int, str]]:
    """Yield name, severity, count and detail of what is worth knowing of the ignored events.

    Args:
        patterns: of the names to leave out.
        counts: (trace index, event name) -> events that occurred.
    """
    occurred = [(name, count) for (_, name), count in counts.items() if count]
    by_pattern = {
        pattern: sum(count for name, count in occurred if fnmatch.fnmatchcase(name, pattern))
        for pattern in dict.fromkeys(patterns)
    }
    used = [f"{pattern} ({count})" for pattern, count in by_pattern.items() if count]
    unused = [pattern for pattern, count in by_pattern.items() if not count]
    if used:
        total = sum(count for name, count in occurred if is_ignored(name, patterns))
        detail = f"events that were left out on request: {', '.join(used)}"
        yield "ignored_events", "info", total, detail
    if unused:
        detail = f"patterns of events to leave out that match none: {', '.join(unused)}"
        yield "ignored_nothing", "warning", len(unused), detail
