"""Formats in which events are written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.backports import StrEnum
from msgflow.export.formats import by_suffix

if TYPE_CHECKING:
    import pyarrow as pa


class EventFormat(StrEnum):
    """A format of events; all but text are exact."""

    TEXT = "text"
    JSON = "json"
    JSONL = "jsonl"
    CSV = "csv"
    PARQUET = "parquet"


TABLES = (EventFormat.CSV, EventFormat.PARQUET)
"""The formats with columns."""

_SUFFIXES = {".txt": EventFormat.TEXT}
_SUFFIXES |= {f".{form}": form for form in EventFormat if form is not EventFormat.TEXT}


def is_directory(path: Path) -> bool:
    """Tell whether an output path means a directory: one that exists, or a name without suffix."""
    return path.is_dir() or not (path.suffix or path.is_file())


def format_of(path: Path | None) -> EventFormat:
    """Return the format of an output path: by its suffix, Parquet for a directory."""
    if path is None:
        return EventFormat.TEXT
    if is_directory(path):
        return EventFormat.PARQUET
    return by_suffix(path, _SUFFIXES) if path.suffix else EventFormat.TEXT


def table_writer(form: EventFormat, sink: Any, schema: pa.Schema) -> Any:
    """Open a writer of CSV or Parquet: a context manager with `write_table`."""
    if form is EventFormat.CSV:
        import pyarrow.csv

        return pyarrow.csv.CSVWriter(sink, schema)
    import pyarrow.parquet

    return pyarrow.parquet.ParquetWriter(sink, schema, compression="zstd")
