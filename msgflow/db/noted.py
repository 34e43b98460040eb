"""Writes the diagnostics of a run that are found once it is stored."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgflow.db.diagnostic import diagnostics, short_name, statement

if TYPE_CHECKING:
    import duckdb

    from msgflow.sql.header import Header


def forget(con: duckdb.DuckDBPyConnection, run_id: int, phase: str) -> None:
    """Delete what was stored of a run in this phase, inside the open transaction."""
    con.execute(
        "DELETE FROM store.diagnostic WHERE run_id = ? AND list_contains(?, name)",
        [run_id, [short_name(header) for header in _stored(phase)]],
    )


def note(con: duckdb.DuckDBPyConnection, run_id: int, phase: str, **values: Any) -> None:
    """Store what there is to tell of a run in this phase, inside the open transaction.

    Args:
        con: a writable connection to a database with current views.
        run_id: the run.
        phase: 'clocks', 'links' or 'database'.
        values: parameters of the diagnostics of this phase, besides the run.
    """
    con.execute(
        "INSERT INTO store.diagnostic (run_id, trace_id, name, severity, count, detail) "
        "SELECT $run_id, trace_id, name, severity, count, detail "
        f"FROM (\n{statement(_stored(phase))})",
        {"run_id": run_id} | values,
    )


def _stored(phase: str) -> list[Header]:
    return [header for header in diagnostics() if header.phase == phase and header.params]
