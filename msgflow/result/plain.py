"""Values of any SQL as all formats can show them: what only DuckDB has becomes its text."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

_DAY_US = 24 * 3_600_000_000


def plain(connection: duckdb.DuckDBPyConnection, table: pa.Table) -> pa.Table:
    """Return the rows, with DuckDB's text in columns that Python or Parquet cannot hold.

    These are intervals, unions, structs and maps without a type inside, and times that Python does
    not have: before year 1, after 9999, 24:00, infinity, or nanoseconds without pandas.
    """
    import pyarrow as pa

    for at, (field, column) in enumerate(zip(table.schema, table.columns, strict=True)):
        if any_within(field.type, _is_unknown) or not _has_python_times(column):
            texts = connection.from_arrow(pa.table({"it": column})).project("it::VARCHAR")
            table = table.set_column(at, field.name, texts.to_arrow_table().column(0))
    return table


def any_within(kind: pa.DataType, is_meant: Callable[[pa.DataType], bool]) -> bool:
    """Tell whether a type is meant, or one inside of it."""
    inside = (kind.field(at).type for at in range(kind.num_fields))
    return is_meant(kind) or any(any_within(one, is_meant) for one in inside)


def _is_unknown(kind: pa.DataType) -> bool:
    from pyarrow import types

    return bool(
        types.is_interval(kind)
        or types.is_union(kind)
        or (types.is_struct(kind) and not kind.num_fields)
        or (types.is_map(kind) and types.is_null(kind.key_type))
        or (types.is_time64(kind) and kind.unit == "ns")
        or (types.is_timestamp(kind) and kind.unit == "ns" and find_spec("pandas") is None)
    )


def _has_python_times(column: pa.ChunkedArray) -> bool:
    from pyarrow import compute, types

    if types.is_time64(column.type):
        # Python would begin the day again.
        return bool(compute.max(column).value != _DAY_US)
    try:
        if types.is_temporal(column.type):
            compute.min_max(column).as_py()
        elif any_within(column.type, types.is_temporal):
            column.to_pylist()
    except (OverflowError, ValueError):
        return False
    return True
