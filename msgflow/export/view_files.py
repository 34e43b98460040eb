"""Files of public views, within a time window: Parquet, partitioned by run, and CSV."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.db.objects import public_names
from msgflow.errors import UsageError
from msgflow.export.formats import write_csv
from msgflow.files.atomic_directory import PARTITION_FILE, replacing_entries
from msgflow.run.window import WHOLE, Window
from msgflow.text.name_suggestions import did_you_mean
from msgflow.version import __version__

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice

_ROWS_AT_ONCE = 100_000
# Readers take this column from the name of the partition: the file must not have it.
_PARTITION = "run_id"
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
            hint = did_you_mean(view, list(columns), f"msgflow db schema; a directory: -o {view}")
            raise UsageError(f"there is no such view — {view}", hint)
    runs = part.runs(connection)
    if not runs:
        raise UsageError("the database holds no run yet", "msgflow ingest TRACE")
    chosen = tuple(sorted(set(views)) or sorted(columns))
    return Selection(chosen, columns, runs, part.window(runs))


def export_parquet(
    connection: duckdb.DuckDBPyConnection, directory: Path, selection: Selection, *, force: bool
) -> tuple[ExportedView, ...]:
    """Write views to `directory/VIEW/run_id=ID/data.parquet`, all or none, rows in order."""
    import pyarrow.parquet

    from msgflow.db.connection import recorded_revision

    metadata = {
        "msgflow.version": __version__,
        "msgflow.schema_revision": recorded_revision(connection.cursor()) or "",
    }
    counts = dict.fromkeys(selection.views, 0)
    with replacing_entries(directory, selection.views, force=force) as aside:
        for view, run in product(selection.views, selection.runs):
            partition = aside / view / f"{_PARTITION}={run.run_id}"
            partition.mkdir(parents=True)
            with selection.read(connection, view, [run]) as reader:
                names = [name for name in reader.schema.names if name != _PARTITION]
                schema = pyarrow.schema([reader.schema.field(name) for name in names])
                about = metadata | {"msgflow.view": view, "pandas": _pandas_types(schema)}
                with pyarrow.parquet.ParquetWriter(
                    partition / PARTITION_FILE, schema.with_metadata(about), compression="zstd"
                ) as writer:
                    for batch in reader:
                        writer.write_batch(batch.select(names))
                        counts[view] += batch.num_rows
    return tuple(ExportedView(view, directory / view, count) for view, count in counts.items())


def export_csv(
    connection: duckdb.DuckDBPyConnection, directory: Path, selection: Selection, *, force: bool
) -> tuple[ExportedView, ...]:
    """Write views to `directory/VIEW.csv`, all of them or none, rows sorted by all columns."""
    names = {view: f"{view}.csv" for view in selection.views}
    counts = dict.fromkeys(names, 0)
    with replacing_entries(directory, list(names.values()), force=force) as aside:
        for view, name in names.items():
            with selection.read(connection, view, selection.runs) as reader:
                counts[view] = write_csv(reader.schema, reader, aside / name, is_safe=False)
    return tuple(ExportedView(view, directory / names[view], counts[view]) for view in names)


def _pandas_types(schema: pa.Schema) -> str:
    """Return metadata for pandas: nullable types for integers and truth values."""
    import pyarrow

    # int64 becomes Int64, uint8 becomes UInt8.
    columns = [
        {
            "name": field.name,
            "field_name": field.name,
            "pandas_type": name,
            "numpy_type": name.replace("int", "Int").replace("u", "U").replace("bool", "boolean"),
            "metadata": None,
        }
        for field, name in ((field, str(field.type)) for field in schema)
        if pyarrow.types.is_integer(field.type) or name == "bool"
    ]
    return json.dumps({"columns": columns, "index_columns": [], "column_indexes": []})
