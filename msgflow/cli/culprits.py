"""What makes data late, as blocks of lines for people: of `why`, and at the end of a recording."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from msgflow.text.values import printable
from msgflow.text.wrapping import hanging, wrap

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult


def culprit_lines(
    verdict: QueryResult,
    command_of: Callable[[Sequence[str]], str],
    width: int,
    *,
    whole: str = "--wide",
) -> Iterator[str]:
    """Yield a block for each of the worst culprits, and an empty line behind each.

    `command_of` returns what the shell runs, of words behind `msgflow`; `whole` shows all of them.
    """
    from msgflow.query.why import MOST_CULPRITS

    rows = verdict.table.to_pylist()
    for row in rows[:MOST_CULPRITS]:
        yield from wrap(printable(row["headline"]), width)
        for line in row["evidence"]:
            yield from hanging("  ", printable(line), width)
        if row["next"] is not None:
            yield f"  next: {printable(command_of(shlex.split(row['next'])))}"
        yield ""
    if (more := len(rows) - MOST_CULPRITS) > 0:
        yield f"{more} more ({whole})"
        yield ""
