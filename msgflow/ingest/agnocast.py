"""Events of Agnocast, whose messages pass neither rcl nor the middleware, as events of ROS 2.

`schema/agnocast.sql` says which event says what.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.files.resources import resource_directory
from msgflow.ingest.catalogue import load

if TYPE_CHECKING:
    from collections.abc import Collection

    import duckdb


def translate(con: duckdb.DuckDBPyConnection, empty: Collection[str]) -> bool:
    """Add what these events say to the tables of ROS 2's events; tell whether there were any."""
    tables = [f"raw.{each.table}" for each in load().staged.values() if each.is_translated]
    if all(table in empty for table in tables):
        return False
    con.execute((resource_directory("schema") / "agnocast.sql").read_text(encoding="utf-8"))
    return True
