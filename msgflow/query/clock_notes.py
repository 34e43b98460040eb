"""Notes on clocks: how far times of several clocks can be compared."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import duckdb
    import pyarrow as pa

    from msgflow.run.choice import Run


def clock_notes(connection: duckdb.DuckDBPyConnection, runs: Sequence[Run]) -> list[str]:
    """Return notes on how far times of several hosts can be compared, a sentence each."""
    chosen = {"runs": [run.run_id for run in runs]}
    # Most runs have one clock and need no note: this first statement takes no time.
    several = connection.execute(
        "SELECT 1 FROM main.clock WHERE list_contains($runs, run_id) "
        "GROUP BY run_id HAVING count(*) > 1 LIMIT 1",
        chosen,
    )
    if not several.fetchall():
        return []
    return _sentences(connection, "clock_note", chosen)


def untraced_notes(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], table: pa.Table
) -> list[str]:
    """Return where flows begin whose first publisher is not traced, if paths have any."""
    if "path" not in table.column_names:
        return []
    chosen = {"runs": [run.run_id for run in runs]}
    begins = internal_sql().run(connection, "untraced_begin", chosen).fetchall()
    if not begins:
        return []
    paths = [path for path in table["path"].unique().to_pylist() if path is not None]
    where = {
        True: "the stamp of each message",
        False: "its take: its clock may be another one",
        None: "the stamp of each message, or its take where its clock may be another one",
    }
    return [
        f"what publishes {topic} is not traced: flows begin with {where[is_stamped]}"
        for topic, is_stamped in begins
        if any(path.startswith(f"(not traced) → {topic} → ") for path in paths)
    ]


def clock_verdicts(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], *, only_several: bool = False
) -> list[str]:
    """Return a sentence per run, or per run with several clocks: whether times of hosts compare."""
    chosen = {"runs": [run.run_id for run in runs], "only_several": only_several}
    return _sentences(connection, "clock_verdict", chosen)


def _sentences(
    connection: duckdb.DuckDBPyConnection, name: str, chosen: Mapping[str, Any]
) -> list[str]:
    found = internal_sql().run(connection, name, chosen)
    return [sentence for (sentence,) in found.fetchall()]
