"""What happened at a moment, as people read it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from msgflow.cli.sections import screen_sections
from msgflow.text.values import count, printable
from msgflow.text.wrapping import hanging

if TYPE_CHECKING:
    from msgflow.query.moment import Moment

_MOST = 5
_SHOWN = {
    "occasions": ("began or happened within a second", "at_ns sentence"),
    "callbacks": (
        "ran in the second around it",
        "node callback count longest_ns usual_ns share then",
    ),
    "programs": ("had the CPUs", "program cpus"),
    "paths": ("slow then", "path flows usual_flows median_ns max_ns usual_ns"),
}


def moment_lines(found: Moment, width: int) -> Iterator[str]:
    """Yield a sentence for each change, then a table for each section that has rows."""
    rows = found.sections["changes"].table.to_pylist()
    said = [row["headline"] for row in rows if row["follows"] is None]
    for sentence in said[:_MOST] or [found.headline]:
        yield from hanging("", printable(sentence), width)
    if (more := len(rows) - len(said[:_MOST])) > 0:
        yield f"{count(more, 'more change')} (--wide)"
    yield ""
    shown = {
        title: found.sections[name].with_columns(columns.split())
        for name, (title, columns) in _SHOWN.items()
        if len(found.sections[name])
    }
    yield from screen_sections(shown, width, is_chosen=True)
