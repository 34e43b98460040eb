"""What somebody may have meant who mistyped a name."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING

from msgflow.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence


def nearest(name: str, known: Sequence[str]) -> list[str]:
    """Return at most three of `known` that `name` may be a slip of, the most similar first."""
    similar = difflib.get_close_matches(name, known, n=3, cutoff=0.55)
    longer = [other for other in known if name and name in other and other not in similar]
    return (similar + longer)[:3]


def column_named(name: str, columns: Sequence[str]) -> str:
    """Return the column that a user means by `name`, which may lack the `_ns` at its end.

    Raises:
        UsageError: there is no such column; the message names similar ones.
    """
    for known in (name, f"{name}_ns"):
        if known in columns:
            return known
    near = nearest(name, columns)
    raise UsageError(
        f"there is no such column — {name}",
        f"did you mean {' or '.join(near)}" if near else f"the columns are {', '.join(columns)}",
    )
