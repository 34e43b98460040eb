"""Small Parquet files of a lake, read without pandas and without columns from folder names."""

from __future__ import annotations

import pyarrow as pa
import pyarrow.parquet

_LARGE = 1_000_000


def read_parquet(content: bytes, schema: pa.Schema | None = None) -> pa.Table:
    """Return the rows of a file."""
    # `read_table` would import pandas if that is installed.
    file = pyarrow.parquet.ParquetFile(pa.BufferReader(content))
    # Most files have one row: threads would cost more than they save.
    table = file.read(use_threads=len(content) > _LARGE).replace_schema_metadata()
    if schema is None:
        return table
    if table.schema.equals(schema):
        return pa.Table.from_arrays(table.columns, schema=schema)
    columns = [
        table[field.name].cast(field.type)
        if field.name in table.column_names
        else pa.nulls(len(table), field.type)
        for field in schema
    ]
    return pa.table(columns, schema=schema)
