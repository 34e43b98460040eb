"""Numbers of paths, the same in every command: their places among all paths of the runs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow.query.selection import PATH, Selection

if TYPE_CHECKING:
    from collections.abc import Mapping

    import duckdb

    from msgflow.query.result import QueryResult
    from msgflow.sql.value import Value

_ALL = "SELECT DISTINCT path FROM main.flow_path($runs, NULL, NULL, only_paths := true)"


def with_path_numbers(
    connection: duckdb.DuckDBPyConnection, result: QueryResult, *, has_all: bool
) -> QueryResult:
    """Return a result with the numbers of its paths, if it has several.

    Where flows were asked for that end in the midst of a path, what they take is no path of its
    own: numbers go on there.

    Args:
        connection: to the database with the runs.
        result: of a named query.
        has_all: the result has every path.
    """
    if PATH not in result.columns:
        return result
    own = {path for path in result.table[PATH].unique().to_pylist() if path is not None}
    if len(own) < 2:
        return result
    every = set(own)
    if not has_all:
        runs = {"runs": [run.run_id for run in result.runs]}
        every = {path for (path,) in connection.execute(_ALL, runs).fetchall()}
    texts = [*sorted(every), *sorted(own - every)]
    return replace(result, path_numbers={text: n for n, text in enumerate(texts, start=1)})


def has_all_paths(name: str, parameters: Mapping[str, Value], selection: Selection) -> bool:
    """Tell whether a query with these words has a row for every path."""
    return name == "e2e-latency" and not parameters and selection == Selection()
