"""Numbers of paths, the same in every command: their places among all paths of the runs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.query.selection import PATH

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb

    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run

_ALL = "main.flow_path($runs, only_paths := true)"


def with_path_numbers(
    connection: duckdb.DuckDBPyConnection, result: QueryResult, known: str = _ALL
) -> QueryResult:
    """Return a result with the numbers of its paths, if it has several.

    What ends in the middle of a path is no path of the runs: its number comes behind those of all
    paths. `known` is a table with all of these.
    """
    if PATH not in result.columns:
        return result
    own = {path for path in result.table[PATH].to_pylist() if path is not None}
    if len(own) < 2:
        return result
    every = _every_path(connection, result.runs, known)
    texts = [*every, *sorted(own.difference(every))]
    return replace(result, path_numbers={text: n for n, text in enumerate(texts, start=1)})


def numbered_path(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], number: int
) -> dict[str, list[str]]:
    """Return the arguments of `Database.query` that choose the path with a number."""
    every = _every_path(connection, runs)
    if not 1 <= number <= len(every):
        raise UsageError(
            f"no path has this number — {number}",
            f"msgflow query e2e-latency shows paths 1 to {len(every)}" if every else None,
        )
    return {"via": [every[number - 1]]}


def _every_path(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], known: str = _ALL
) -> list[str]:
    chosen = {"runs": [run.run_id for run in runs]} if known is _ALL else {}
    rows = connection.execute(f"SELECT DISTINCT path FROM {known}", chosen).fetchall()
    return sorted(path for (path,) in rows)
