"""Suggestions for mistyped names."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from msgflow.errors import UsageError


def nearest(name: str, known: Sequence[str]) -> list[str]:
    """Return at most three known names that are like `name`, the most similar first."""
    similar = difflib.get_close_matches(name, known, n=3, cutoff=0.55)
    longer = [other for other in known if name and name in other and other not in similar]
    return (similar + longer)[:3]


def did_you_mean(name: str, known: Sequence[str], otherwise: str) -> str:
    """Return a hint with the known names that are like `name`, or another hint if none is."""
    near = nearest(name, known)
    return f"did you mean {' or '.join(near)}" if near else otherwise


def meant_or(near: Sequence[str], there: str, end: str = ";") -> str:
    """Return a hint: the names that the user may mean, if any, and then what names there are."""
    return f"did you mean {' or '.join(near)}{end} {there}" if near else there


def column_named(name: str, columns: Sequence[str]) -> str:
    """Return the column with a name; the `_ns` at its end may be missing."""
    for known in (name, f"{name}_ns"):
        if known in columns:
            return known
    raise UsageError(
        f"there is no such column — {name}",
        did_you_mean(name, columns, f"the columns are {', '.join(columns)}"),
    )
