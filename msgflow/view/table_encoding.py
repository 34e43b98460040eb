"""Encoding of tables as bytes that a page unpacks quickly, for the server and for files.

Layout: length of the head (4 bytes, little endian), head (JSON), buffers of the columns one after
the other. Whole numbers are differences from row to row, folded to be positive, in as many bytes as
the largest takes; the first bytes of all rows come first, then the second ones, which compresses
well. Text is a dictionary and numbers into it. A browser holds whole numbers up to 2^53 exactly:
points in time are sent as offsets from the begin of the run, anything else beyond it as text.
Control characters in text are escaped, as on a terminal: one that changes the direction of writing
would turn round what stands behind it on the page.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa
from pyarrow import compute

from msgflow.result.query_result import QueryResult
from msgflow.text.values import format_cell, printable
from msgflow.trace.numpy_arrow import is_valid, texts_to_arrow, to_numpy

LARGEST_EXACT = 2**53
_EPOCH = "epoch ns"


def encode(
    table: pa.Table, *, meta: Mapping[str, Any] | None = None, origin_ns: int = 0,
    units: Mapping[str, str] | None = None,
) -> bytes:  # fmt: skip
    """Return `table` as bytes.

    Columns with the unit 'epoch ns' become offsets from `origin_ns`, which is in epoch ns, too.
    `meta` goes into the head, and holds what JSON can hold.
    """
    units = units or {}
    columns = []
    buffers: list[bytes] = []
    for name in table.column_names:
        # pyarrow makes an array of no chunks in a way that imports pandas.
        empty = pa.nulls(0, table.schema.field(name).type)
        column = table[name].combine_chunks() if table.num_rows else empty
        unit = units.get(name)
        head, body = _column(column, origin_ns if unit == _EPOCH else 0)
        columns.append({"name": name, "unit": unit, **head, "bytes": len(body)})
        buffers.append(body)
    content = {"rows": table.num_rows, "meta": dict(meta or {}), "columns": columns}
    head_bytes = json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode()
    return b"".join([len(head_bytes).to_bytes(4, "little"), head_bytes, *buffers])


def encode_result(result: QueryResult, meta: Mapping[str, Any], origin_ns: int = 0) -> bytes:
    """Return rows as bytes, with their notes and what their columns mean beside `meta`."""
    columns = result.header.columns if result.header else ()
    said = {
        "notes": result.notes,
        "columns": {column.name: column.description for column in columns},
    }
    return encode(result.to_arrow(), meta={**meta, **said}, origin_ns=origin_ns, units=result.units)


def _column(column: pa.Array, origin: int) -> tuple[dict[str, Any], bytes]:
    kind = column.type
    if pa.types.is_integer(kind):
        if len(column) > column.null_count:
            limits = compute.min_max(column).as_py()
            if max(abs(limits["min"] - origin), abs(limits["max"] - origin)) > LARGEST_EXACT:
                shifted = compute.subtract(column, origin) if origin else column
                return _text(compute.cast(shifted, pa.string()))
        return _integers(to_numpy(column).astype(np.int64) - origin, ~is_valid(column))
    if pa.types.is_boolean(kind):
        return _integers(to_numpy(column).astype(np.int64), ~is_valid(column), "boolean")
    if pa.types.is_floating(kind):
        values = np.where(is_valid(column), to_numpy(column), np.nan).astype("<f8")
        return {"type": "double"}, values.tobytes()
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        return _text(column)
    if pa.types.is_map(kind):
        return _text(texts_to_arrow([_map_text(value) for value in column.to_pylist()]))
    texts = json.dumps(escaped(column.to_pylist()), ensure_ascii=False, default=str)
    return {"type": "json"}, texts.encode()


def _map_text(value: Any) -> str | None:
    return None if value is None else format_cell(value)


def escaped(value: Any) -> Any:
    """Return what JSON holds with its control characters escaped."""
    if isinstance(value, str):
        return printable(value, keep="\n")
    if isinstance(value, list):
        return [escaped(part) for part in value]
    if isinstance(value, dict):
        return {escaped(name): escaped(part) for name, part in value.items()}
    return value


def _integers(
    values: np.ndarray[Any, Any], is_null: np.ndarray[Any, Any], kind: str = "integer"
) -> tuple[dict[str, Any], bytes]:
    has_nulls = bool(is_null.any())
    if has_nulls:
        # A NULL repeats the value before it, so that the difference is 0.
        latest = np.maximum.accumulate(np.where(is_null, -1, np.arange(len(values))))
        values = np.where(latest >= 0, values[np.maximum(latest, 0)], 0)
    differences = np.diff(values, prepend=np.int64(0))
    folded = ((differences << 1) ^ (differences >> 63)).astype("<u8")
    largest = int(folded.max()) if len(folded) else 0
    width = max((largest.bit_length() + 7) // 8, 1)
    planes = folded.view(np.uint8).reshape(-1, 8)[:, :width].T
    nulls = is_null.astype(np.uint8).tobytes() if has_nulls else b""
    return (
        {"type": kind, "width": width, "nulls": has_nulls},
        np.ascontiguousarray(planes).tobytes() + nulls,
    )


def _text(column: pa.Array) -> tuple[dict[str, Any], bytes]:
    encoded = column.dictionary_encode()
    words = json.dumps(escaped(encoded.dictionary.to_pylist()), ensure_ascii=False).encode()
    # 0 means NULL.
    codes = np.where(is_valid(encoded.indices), to_numpy(encoded.indices).astype(np.int64) + 1, 0)
    head, body = _integers(codes, np.zeros(len(codes), np.bool_))
    return {"type": "text", "width": head["width"], "words": len(words)}, words + body
