"""Timers and topics that stop, as the findings of these names have them: each is said once."""

from __future__ import annotations

from typing import Any

import duckdb

from msgflow.sql.statement import health_sql

Row = dict[str, Any]

_SECOND_NS = 1_000_000_000


class Silences:
    """What has stopped in the windows so far."""

    def __init__(self) -> None:
        self._seen: set[tuple[str, int]] = set()
        # Since when what was told is silent, by its subject. Corrected clocks differ a little.
        self._told: dict[str, int] = {}

    def further(self, con: duckdb.DuckDBPyConnection) -> list[Row]:
        """Return what has stopped in a window, and was not told before.

        Each has `what` ('timer' or 'topic'), `subject`, `at_ns`, and in `sentence` how often it is
        missing, and what began or ended then. A window has to have ten of its periods.
        """
        # As a rule nothing is silent: that is known in a hundredth of the time of a step.
        if not con.execute("SELECT 1 FROM derive.silent_object LIMIT 1").fetchall():
            return []
        ((run_id,),) = con.execute("SELECT run_id FROM store.run").fetchall()
        stopped = con.execute("SELECT what, at_ns FROM main.stopped_series(?)", [run_id])
        before, self._seen = self._seen, set(stopped.fetchall())
        # What else happened takes ten times as long to find.
        if self._seen <= before:
            return []
        rows = health_sql().rows(con, "silent_series", {"run_id": run_id})
        further = [
            row for row in rows if row["at_ns"] - self._told.get(row["subject"], 0) > _SECOND_NS
        ]
        self._told |= {row["subject"]: row["at_ns"] for row in further}
        return further


def silence_line(row: Row) -> str:
    """Return in one line what stopped."""
    return f"{row['subject']} stopped: {row['sentence']}"
