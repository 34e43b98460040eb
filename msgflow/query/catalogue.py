"""Catalogue of named queries: one file each below `queries/`, found without a database."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.name_suggestions import nearest
from msgflow.resources import resource_directory
from msgflow.sql.header import Header, read

if TYPE_CHECKING:
    from collections.abc import Callable, Collection


QUERIES_BY_WORD = {
    "jitter": ("timers", "publication-rate"),
    "rate": ("publication-rate",),
    "frequency": ("publication-rate",),
    "hz": ("publication-rate",),
    "period": ("timers", "publication-rate"),
    "timer": ("timers",),
    "lateness": ("timers",),
    "drop": ("delivery",),
    "dropped": ("delivery",),
    "los": ("delivery", "data-quality"),
    "lost": ("delivery", "unmatched"),
    "delivery": ("delivery",),
    "blocking": ("interference",),
    "blocked": ("interference", "waits"),
    "preemption": ("interference",),
    "latency": ("e2e-latency", "transport-latency", "service-latency", "action-latency"),
    "latencie": ("e2e-latency", "transport-latency", "service-latency", "action-latency"),
    "end-to-end": ("e2e-latency",),
    "path": ("e2e-latency", "path-breakdown"),
    "slow": ("critical-path", "flows"),
    "slowest": ("critical-path", "flows"),
    "bottleneck": ("critical-path", "path-breakdown"),
    "dd": ("transport-latency", "path-breakdown"),
    "network": ("transport-latency", "path-breakdown"),
    "transport": ("transport-latency",),
    "cpu": ("executor-usage",),
    "utilisation": ("executor-usage",),
    "utilization": ("executor-usage",),
    "load": ("executor-usage",),
    "duration": ("callback-duration", "callbacks"),
    "runtime": ("callback-duration",),
    "callback": ("callbacks", "callback-duration"),
    "wcet": ("callback-duration",),
    "queue": ("executor-wait", "delivery"),
    "waiting": ("executor-wait", "waits"),
    "age": ("data-age",),
    "freshnes": ("data-age",),
    "reaction": ("reaction-time",),
    "action": ("action-latency",),
    "goal": ("action-latency",),
    "service": ("service-latency",),
    "topic": ("info-topics",),
    "node": ("info-nodes",),
    "host": ("info-hosts",),
    "run": ("info-runs",),
    "proces": ("info-processes",),
    "diagnostic": ("info-findings",),
}
"""Words that people use, without the s of a plural, and the queries that answer them."""


@cache
def query_names() -> tuple[str, ...]:
    """Return the names of all queries, sorted; reads no file."""
    return tuple(sorted(path.stem for path in resource_directory("queries").glob("*.sql")))


def load_query(name: str, views: Callable[[], Collection[str]] = tuple) -> Header:
    """Return the query called `name`.

    Args:
        name: of the query.
        views: returns the names of the public views, for hints.

    Raises:
        UsageError: there is no such query; the message names similar ones.
    """
    if name not in query_names():
        raise UsageError(f"there is no such query — {name}", _meant(name, views))
    return _header(name)


@cache
def _header(name: str) -> Header:
    return read(resource_directory("queries") / f"{name}.sql")


def _meant(name: str, views: Callable[[], Collection[str]]) -> str:
    """Return a hint for a name that no query has: the commands that the user may mean."""
    words = QUERIES_BY_WORD.get(name.lower().removesuffix("s").replace("_", "-"))
    if words is None:
        if name in views():
            return f"it is a view: msgflow sql 'FROM {name}'"
        words = tuple(nearest(name, query_names()))
    return " or ".join(f"msgflow query {other}" for other in words) or "msgflow query --list"


def load_queries() -> tuple[Header, ...]:
    """Return all queries, sorted by name."""
    return tuple(load_query(name) for name in query_names())
