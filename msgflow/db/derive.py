"""Stores what is costly to infer: each derived view becomes rows of the table of its name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.db import objects

if TYPE_CHECKING:
    import duckdb

# Tables of `store` that hold the rows of the view of that name in `derive`.
DERIVED = ("link_transport", "link_causal")


def derive(con: duckdb.DuckDBPyConnection, run_id: int) -> None:
    """Derive the links of a run anew, inside the open transaction.

    Args:
        con: a writable connection to a database with current views.
        run_id: the run; nothing happens to others.
    """
    for name in DERIVED:
        columns = ", ".join(
            row[0]
            for row in con.execute(
                "SELECT column_name FROM duckdb_columns() WHERE schema_name = 'store' "
                "AND database_name = current_database() AND table_name = ? ORDER BY column_index",
                [name],
            ).fetchall()
        )
        con.execute(f"DELETE FROM store.{name} WHERE run_id = ?", [run_id])
        con.execute(
            f"INSERT INTO store.{name} ({columns}) "
            f"SELECT {columns} FROM derive.{name} WHERE run_id = ?",
            [run_id],
        )
    con.execute(
        "UPDATE store.run SET derivation_hash = ? WHERE run_id = ?",
        [objects.derivation_hash(), run_id],
    )


def stale_runs(con: duckdb.DuckDBPyConnection) -> list[tuple[int, str]]:
    """Return (run_id, name) of the runs whose links were derived by other SQL than today's."""
    return con.execute(
        "SELECT run_id, name FROM store.run WHERE derivation_hash <> ? ORDER BY run_id",
        [objects.derivation_hash()],
    ).fetchall()
