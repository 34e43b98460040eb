"""Metrics of requirements: each is an expression over the columns of a named query.

The data is in `metrics.toml`, whose top says what the fields mean.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from msgflow.backports import tomllib
from msgflow.verify.condition import Dimension

# Kinds that are not like others: a path, and the way between two topics or nodes.
PATH, ENDS = "path", "from"
_FILE = Path(__file__).with_name("metrics.toml")


@dataclass(frozen=True)
class Metric:
    """A metric."""

    query: str
    value: str
    dimension: Dimension
    statistics: tuple[str, ...] = ()
    samples: str = "count"
    worst: str | None = None
    missing: str = "too few values in the time window"
    lacking: str | None = None


@dataclass(frozen=True)
class Filter:
    """A field of a target that chooses rows."""

    columns: dict[str, list[str]]  # by query
    names: str  # SQL
    what: str  # the word for such a name in errors


@dataclass(frozen=True)
class Subject:
    """A kind of thing with requirements."""

    metrics: dict[str, Metric]  # by name
    label: dict[str, str]  # by query
    filters: dict[str, Filter]  # by field of the file


def _subject(given: dict[str, Any], names: dict[str, str]) -> Subject:
    metrics = {
        name: Metric(
            **one
            | {
                "dimension": Dimension(one["dimension"]),
                "statistics": tuple(one.get("statistics", ())),
            }
        )
        for name, one in given["metrics"].items()
    }

    def by_query(value: Any) -> dict[str, Any]:
        # What is no table is the same for all queries.
        queries = [metric.query for metric in metrics.values()]
        return value if isinstance(value, dict) else dict.fromkeys(queries, value)

    filters = {
        field: Filter(by_query(one["columns"]), names[one["names"]], one["names"])
        for field, one in given.get("fields", {}).items()
    }
    return Subject(metrics, by_query(given["label"]), filters)


_GIVEN = tomllib.loads(_FILE.read_text(encoding="utf-8"))
KEYS: dict[str, str] = _GIVEN.pop("keys")
"""SQL of what finds the worst case in a row of the measuring query, by the kind of the case."""

_NAMES = _GIVEN.pop("names")
SUBJECTS = {kind: _subject(given, _NAMES) for kind, given in _GIVEN.items()}
"""Kinds of things with requirements, by the key of a target that names them."""
