"""Tracers that are known to write packets which contradict themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


def events_may_follow_end(environment: Mapping[str, int | str]) -> bool:
    """Tell whether events may be later than the end of their packet.

    True of LTTng-UST before 2.11 and LTTng-modules before 2.9.13, 2.10.10 and 2.11.
    """
    version = tuple(
        value if isinstance(value := environment.get(f"tracer_{part}", 0), int) else 0
        for part in ("major", "minor", "patchlevel")
    )
    match environment.get("tracer_name"):
        case "lttng-ust":
            return version < (2, 11, 0)
        case "lttng-modules":
            return version < (2, 9, 13) or (2, 10, 0) <= version < (2, 10, 10)
        case _:
            return False
