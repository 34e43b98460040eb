"""The named queries: one file each below `queries/`, found without opening a database."""

from __future__ import annotations

import difflib
from functools import cache
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.query.header import Header, read
from msgflow.resources import resource_directory

if TYPE_CHECKING:
    from collections.abc import Sequence


@cache
def query_names() -> tuple[str, ...]:
    """Return the names of all queries, sorted; reads no file."""
    return tuple(sorted(path.stem for path in resource_directory("queries").glob("*.sql")))


@cache
def load_query(name: str) -> Header:
    """Return the query called `name`.

    Raises:
        UsageError: there is no such query; the message names similar ones.
    """
    if name not in query_names():
        near = [f"msgflow query {other}" for other in nearest(name, query_names())]
        raise UsageError(
            f"there is no such query — {name}", " or ".join(near) or "msgflow query --list"
        )
    return read(resource_directory("queries") / f"{name}.sql")


def load_queries() -> tuple[Header, ...]:
    """Return all queries, sorted by name."""
    return tuple(load_query(name) for name in query_names())


def nearest(name: str, known: Sequence[str]) -> list[str]:
    """Return at most three of `known` that `name` may be a slip of, the most similar first."""
    similar = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    longer = [other for other in known if name and name in other and other not in similar]
    return (similar + longer)[:3]
