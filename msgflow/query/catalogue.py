"""Catalogue of named queries: one file each below `queries/`, found without a database.

A query may have variants, each in a file of its own: an option chooses one.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.backports import tomllib
from msgflow.errors import UsageError
from msgflow.files.resources import resource_directory
from msgflow.sql.header import Header, read
from msgflow.sql.value import parse_text
from msgflow.text.name_suggestions import nearest

if TYPE_CHECKING:
    from msgflow.sql.value import Value

COMMANDS = ("clocks", "graph", "info", "links")
"""Queries that have a command of their own: `msgflow clocks`, not `msgflow query clocks`."""


@cache
def queries_by_word() -> Mapping[str, Sequence[str]]:
    """Return the words that people use, and the queries that answer them."""
    found: dict[str, list[str]] = {}
    text = Path(__file__).with_name("words.toml").read_text(encoding="utf-8")
    for name, words in tomllib.loads(text).items():
        for word in words.split():
            found.setdefault(word, []).append(name)
    return found


@cache
def _files() -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in resource_directory("queries").glob("*.sql")))


@cache
def query_names() -> tuple[str, ...]:
    """Return the names of all queries, sorted, without their variants; reads no file."""
    return tuple(name for name in _files() if _base(name) is None)


def _base(name: str) -> str | None:
    """Return the query that this is a variant of, else None."""
    return next((other for other in _files() if name.startswith(f"{other}-")), None)


def load_query(name: str, views: Callable[[], Collection[str]] = tuple) -> Header:
    """Return the query, or the variant of a query, whose file is called `name`."""
    if name not in _files():
        raise UsageError(f"there is no such query — {name}", _meant(name, views))
    return _header(name)


def choose_query(
    name: str, given: Mapping[str, Value], views: Callable[[], Collection[str]] = tuple
) -> Header:
    """Return the query called `name`, or that variant of it which its parameters choose."""
    header = load_query(name, views)
    base = header.words.partition(" ")[0]
    own = header.name.removeprefix(f"{base}-")
    chosen: dict[str, str] = {}
    for variant in header.variants:
        if (value := given.get(variant.name)) is None:
            if own in (*variant.choices, variant.name):
                chosen[header.name] = header.words.partition(" ")[2]
            continue
        if variant.type == "BOOLEAN":
            with suppress(ValueError):
                value = variant.name if parse_text(str(value), variant.type) else variant.default
        if value == variant.default and own in (*variant.choices, variant.name):
            header = _header(base)
        # The query refuses a value that it does not have.
        elif f"{base}-{value}" in _files():
            chosen[f"{base}-{value}"] = f"--{variant.name} {value}"
    if len(chosen) > 1:
        raise UsageError(
            f"these do not go together — {' and '.join(chosen.values())}", "leave one of them out"
        )
    return _header(*chosen) if chosen else header


@cache
def _header(name: str) -> Header:
    header = read(resource_directory("queries") / f"{name}.sql")
    base = _base(name)
    if base is not None:
        value = name.removeprefix(f"{base}-")
        variants = _header(base).variants
        own = next(each for each in variants if value in (*each.choices, each.name))
        words = f" {value}" if own.choices else ""
        header = replace(header, chosen=f"{base} --{own.name}{words}", variants=variants)
    return replace(
        header, is_command=(base or name) in COMMANDS, params=(*header.variants, *header.params)
    )


def queries_meant(word: str) -> tuple[Header, ...]:
    """Return the queries that a word means: the one of that name, or those that answer it."""
    name = word.lower().replace("_", "-")
    names = (name,) if name in _files() else queries_by_word().get(name.removesuffix("s"), ())
    return tuple(map(load_query, names))


def _meant(name: str, views: Callable[[], Collection[str]]) -> str:
    """Return a hint for a name that no query has: the commands that the user may mean."""
    meant = queries_meant(name)
    if not meant:
        if name in views():
            return f"it is a view: msgflow sql 'FROM {name}'"
        meant = tuple(map(load_query, nearest(name, query_names())))
    return " or ".join(header.command for header in meant) or "msgflow query"


def load_queries() -> tuple[Header, ...]:
    """Return all queries, sorted by name, each with its variants behind it."""
    return tuple(map(_header, _files()))
