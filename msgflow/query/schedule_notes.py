"""Notes of a comparison: did callbacks compute longer, in which functions, or wait for a CPU?"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

from msgflow.sql.statement import internal_sql
from msgflow.text.values import format_duration

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import duckdb

    from msgflow.result.query_result import QueryResult
    from msgflow.sql.value import Value

_MOST = 3
_SAMPLED = "SELECT count(DISTINCT run_id) FROM main.stack_sample WHERE run_id IN ($run_a, $run_b)"
_ASKED = ("run_a", "run_b", "skip_first", "a_window", "b_window")
_PARTS = {
    "running_ns": "CPU time",
    "queue_ns": "waiting for a CPU",
    "blocked_ns": "sleeping or blocked",
}


def schedule_notes(
    connection: duckdb.DuckDBPyConnection, asked: Mapping[str, Value], result: QueryResult
) -> Iterator[str]:
    """Yield a sentence for each of the callbacks that changed most, where the kernel was traced."""
    rows = result.table.select(["subject", "verdict"]).to_pylist()
    changed = {row["subject"] for row in rows if row["verdict"] in ("B is longer", "B is shorter")}
    if not changed:
        return
    given = {name: asked[name] for name in _ASKED}
    found = internal_sql().rows(connection, "callback_time", given | {"subjects": sorted(changed)})
    for row in islice(found, _MOST):
        yield f"{row['subject']}, on average {_change(row, 'duration_ns')}: {_parts(row)}"


def function_notes(
    connection: duckdb.DuckDBPyConnection, asked: Mapping[str, Value]
) -> Iterator[str]:
    """Yield a sentence for each function that changed most, where both runs have samples."""
    runs = {name: asked[name] for name in ("run_a", "run_b")}
    ((sampled,),) = connection.execute(_SAMPLED, runs).fetchall()
    if sampled < len({*runs.values()}):
        return
    given = {name: asked[name] for name in (*_ASKED, "at_least")}
    for row in islice(internal_sql().rows(connection, "changed_function", given), _MOST):
        a, b = (format_duration(row[name]) for name in ("a_ns", "b_ns"))
        yield (
            f"{row['node']} · {row['callback']}: CPU time per call in {row['function']} {a} → {b}"
            f" ({row['a_samples']:,} and {row['b_samples']:,} samples)"
        )


def _parts(row: Mapping[str, Any]) -> str:
    parts = sorted(_PARTS, key=lambda name: -abs(row[name]))
    return ", ".join(f"{_change(row, name)} {_PARTS[name]}" for name in parts if row[name])


def _change(row: Mapping[str, Any], name: str) -> str:
    value = row[name]
    return f"{format_duration(abs(value))} {'more' if value >= 0 else 'less'}"
