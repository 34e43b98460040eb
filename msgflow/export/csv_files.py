"""CSV files of public views, one per view."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.export.formats import csv_batch
from msgflow.export.views import ExportedView, Selection
from msgflow.files.atomic_directory import replacing_entries

if TYPE_CHECKING:
    from pathlib import Path

    import duckdb


def export_csv(
    connection: duckdb.DuckDBPyConnection,
    directory: Path,
    selection: Selection,
    *,
    force: bool,
) -> tuple[ExportedView, ...]:
    """Write views to `directory/VIEW.csv`, all of them or none, rows sorted by all columns."""
    import pyarrow.csv

    from msgflow.trace.numpy_arrow import empty_batch

    names = {view: f"{view}.csv" for view in selection.views}
    counts = dict.fromkeys(names, 0)
    with replacing_entries(directory, list(names.values()), force=force) as aside:
        for view, name in names.items():
            with selection.read(connection, view, selection.runs) as reader:
                empty = csv_batch(empty_batch(reader.schema))
                with pyarrow.csv.CSVWriter(aside / name, empty.schema) as writer:
                    for batch in reader:
                        writer.write_batch(csv_batch(batch))
                        counts[view] += batch.num_rows
    return tuple(ExportedView(view, directory / names[view], counts[view]) for view in names)
