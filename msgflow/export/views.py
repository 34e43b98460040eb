"""Public views to export: their rows, run by run, within a time window."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.db.objects import public_names
from msgflow.errors import UsageError
from msgflow.run.window import WHOLE, Window
from msgflow.text.name_suggestions import did_you_mean

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice

_ROWS_AT_ONCE = 100_000
_COLUMNS = """
SELECT table_name, list(column_name)
FROM duckdb_columns()
WHERE database_name = current_database() AND schema_name = 'main'
GROUP BY table_name
ORDER BY table_name
"""
# The time of a row is the first of these columns that the view has …
_TIMES = ("start_ns", "sent_ns", "published_ns", "taken_ns", "at_ns", "from_ns")
# (or the take, where the sending is not in the trace)
_SENT = "coalesce(sent_ns, taken_ns)"
# … else the time of the first of these things: for a link, of its cause.
_THINGS = (
    ("request", _SENT),
    ("response", _SENT),
    ("callback_instance", "start_ns"),
    ("publication", "start_ns"),
    ("take", "taken_ns"),
)
# The times of these views say how far a recording reaches: a window does not cut them.
_WHOLE = ("run", "trace")


@dataclass(frozen=True)
class ExportedView:
    """One view that was written.

    Attributes:
        view: its name.
        path: the file, or the directory with one file per run.
        row_count: rows written.
    """

    view: str
    path: Path
    row_count: int


@dataclass(frozen=True)
class Selection:
    """Views to export, with their runs and times."""

    views: tuple[str, ...]  # names of the views, sorted
    columns: dict[str, list[str]]  # columns of each
    runs: tuple[Run, ...]  # the runs, at least one
    window: Window  # the time window

    def read(
        self, connection: duckdb.DuckDBPyConnection, view: str, runs: Sequence[Run]
    ) -> pa.RecordBatchReader:
        """Return the rows of a view, sorted by all columns: equal content gives equal rows."""
        # The name is one that msgflow declares.
        text = f'SELECT * FROM main."{view}" WHERE list_contains($runs, run_id)'
        bindings: dict[str, object] = {"runs": [run.run_id for run in runs]}
        condition = self._condition(view)
        if condition is not None:
            text += f" AND {condition}"
            bindings |= self.window.bindings
        relation = connection.sql(f"{text} ORDER BY ALL", params=bindings)
        return relation.to_arrow_reader(_ROWS_AT_ONCE)

    def _condition(self, view: str) -> str | None:
        columns = self.columns[view]
        if view in _WHOLE or self.window == WHOLE:
            return None
        for name in _TIMES:
            if name in columns:
                is_sent = name in ("sent_ns", "published_ns") and "taken_ns" in columns
                time = f"coalesce({name}, taken_ns)" if is_sent else name
                return f"{time} >= $start_ns AND {time} < $end_ns"
        for thing, name in _THINGS:
            if f"{thing}_id" in columns:
                return (
                    f"{thing}_id IN (SELECT {thing}_id FROM main.{thing}"
                    f" WHERE {name} >= $start_ns AND {name} < $end_ns)"
                )
        return None


def select_views(
    connection: duckdb.DuckDBPyConnection, views: Sequence[str], part: Slice
) -> Selection:
    """Return the views to export, by their names; all that msgflow declares when there are none."""
    # A database of somebody else may have views of any name, which would become names of files.
    declared = set(public_names())
    found = connection.execute(_COLUMNS).fetchall()
    columns = {view: names for view, names in found if view in declared}
    for view in views:
        if view not in columns:
            hint = did_you_mean(view, list(columns), "msgflow db schema")
            raise UsageError(f"there is no such view — {view}", hint)
    runs = part.runs(connection)
    if not runs:
        raise UsageError("the database holds no run yet", "msgflow ingest TRACE")
    chosen = tuple(sorted(set(views)) or sorted(columns))
    return Selection(chosen, columns, runs, part.window(runs))
