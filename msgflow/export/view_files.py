"""Files of public views: Parquet, partitioned by run, with metadata that describe them; CSV."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.export.formats import write_csv
from msgflow.export.views import ExportedView, Selection
from msgflow.files.atomic_directory import PARTITION_FILE, replacing_entries
from msgflow.version import __version__

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa


# Readers take this column from the name of the partition: the file must not have it.
_PARTITION = "run_id"


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

    columns: list[dict[str, Any]] = []
    for field in schema:
        name = str(field.type)
        if pyarrow.types.is_boolean(field.type):
            types = ("bool", "boolean")
        elif pyarrow.types.is_integer(field.type):
            types = (name, f"{'UInt' if name.startswith('u') else 'Int'}{field.type.bit_width}")
        else:
            continue
        columns.append(
            {
                "name": field.name,
                "field_name": field.name,
                "pandas_type": types[0],
                "numpy_type": types[1],
                "metadata": None,
            }
        )
    return json.dumps({"columns": columns, "index_columns": [], "column_indexes": []})
