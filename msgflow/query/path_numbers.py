"""Numbers of paths, the same in every command: their places among all paths of the runs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow.query.selection import PATH

if TYPE_CHECKING:
    import duckdb

    from msgflow.result.query_result import QueryResult

_ALL = "SELECT DISTINCT path FROM main.flow_path($runs, NULL, NULL, only_paths := true)"


def with_path_numbers(connection: duckdb.DuckDBPyConnection, result: QueryResult) -> QueryResult:
    """Return a result with the numbers of its paths, if it has several.

    A query may ask for flows that end in the middle of a path. What they pass is no path of the
    runs: its number comes behind those of all paths.

    Args:
        connection: to the database with the runs.
        result: of a named query.
    """
    if PATH not in result.columns:
        return result
    own = {path for path in result.table[PATH].to_pylist() if path is not None}
    if len(own) < 2:
        return result
    runs = {"runs": [run.run_id for run in result.runs]}
    every = {path for (path,) in connection.execute(_ALL, runs).fetchall()}
    texts = [*sorted(every), *sorted(own - every)]
    return replace(result, path_numbers={text: n for n, text in enumerate(texts, start=1)})
