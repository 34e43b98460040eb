"""Names in YAML files that are written: what comes back is what was written."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import duckdb
import pyarrow as pa
import pytest
from hypothesis import example, given
from hypothesis.strategies import text
from ruamel.yaml import YAML

from msgflow.files.yaml_file import in_quotes, list_lines, quoted
from msgflow.links.suggested_links import LinkSuggestions
from msgflow.paths.suggested_paths import suggest_paths
from msgflow.query.catalogue import load_query
from msgflow.verify.suggested_targets import QUERIES, suggest_targets

# They end a line of YAML, end a comment, or are not allowed: what follows is a stranger's.
HOSTILE = [
    "\u2028- {x: y}",
    "\x85links: []",
    "\x9b1m",
    "\x00",
    "\ufeff",
    "\r\n- a",
    "'\"\\",
    "# a: b",
]


def read(content: str) -> Any:
    return YAML(typ="safe", pure=True).load(content)


def result(query: str, values: dict[str, Any] | None) -> pa.Table:
    """Return a result of a query: with one row that has these values, or none."""
    columns = load_query(query).columns
    row = {column.name: (values or {}).get(column.name) for column in columns}
    listed = ", ".join(
        f"${name}::{column.type} AS {name}" for name, column in zip(row, columns, strict=True)
    )
    return duckdb.sql(f"SELECT {listed} LIMIT {int(bool(values))}", params=row).to_arrow_table()


@given(text())
@example("no")
@example("\u2028")
@example("\U0001f600")
def test_a_name_comes_back(name: str) -> None:
    lines = ["a:", *list_lines("  b", [quoted(name), in_quotes(name)], 10)]
    assert read("\n".join(lines)) == {"a": {"b": [name, name]}}


@pytest.mark.parametrize("name", HOSTILE)
def test_suggestions_are_read_with_the_names_that_they_hold(name: str) -> None:
    """Also those that stand in comments."""
    row = {
        "kind": "direct",
        "node": f"/{name}",
        "inputs": [f"/in{name}"],
        "outputs": ["/out"],
        "is_name_repeated": True,
        "pid": 1,
        "host": name,
        "evidence": name,
        "doubt": None,
    }
    doubtful = row | {"doubt": name}
    links = read(LinkSuggestions([], [row, doubtful], [row]).text("msgflow"))
    entry = {"kind": "direct", "node": f"/{name}", "process": 1, "host": name}
    assert links == {"links": [entry | {"inputs": [f"/in{name}"], "outputs": ["/out"]}] * 2}

    path = {"path": f"(source) → /in{name} → /out", "reached": 1, "roots": 2, "p99_ns": None}
    (named,) = read(suggest_paths([path]))["paths"]
    assert (named["from"], named["to"]) == (f"/in{name}", "/out")

    given = {
        "service-latency": {"service_name": name, "answered": 99, "round_trip_p99_ns": 10**6},
        "topics-delivery": {
            "topic_name": name,
            "subscriber": name,
            "delivered_percent": 1,
            "dropped": 1,
            "lost": 1,
        },
    }
    results = {query: result(query, given.get(query)) for query in QUERIES}
    run: Any = SimpleNamespace(name=name)
    (target,) = read(suggest_targets(run, results, 0.1))["targets"]
    # Brackets make a pattern of them: one that means themselves.
    assert target["service"].replace("[[]", "[") == name
