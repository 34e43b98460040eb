"""Conversion between numpy and Arrow.

pyarrow's own ways import pandas wherever that is installed, to see whether they were given
something of it: that takes longer than reading a small trace. Nor is `numpy.ma` imported.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

Values = NDArray[Any]
Integers = NDArray[np.int64]
Truths = NDArray[np.bool_]
"""Arrays: of any values, of integers, of truth values."""

_type_of = functools.cache(pa.from_numpy_dtype)


def distinct(values: Values) -> Values:
    """Return each value once, in order; where that is all that is wanted, numpy imports `ma`."""
    return np.unique(values, return_index=True)[0]


def to_arrow(values: Values, is_missing: Truths | None = None) -> pa.Array:
    """Return numbers or truth values; those that are missing are NULL."""
    count = values.size
    valid = None if is_missing is None or not is_missing.any() else _bits(~is_missing)
    if values.dtype == np.bool_:
        return pa.Array.from_buffers(pa.bool_(), count, [valid, _bits(values)])
    native = np.ascontiguousarray(values, values.dtype.newbyteorder("="))
    return pa.Array.from_buffers(_type_of(native.dtype), count, [valid, pa.py_buffer(native)])


def integers_to_arrow(values: Sequence[int | None], data_type: pa.DataType) -> pa.Array:
    """Return integers, those that do not fit wrapped round as C would, or truth values."""
    is_missing = np.array([value is None for value in values], np.bool_)
    given = [value or 0 for value in values]
    if pa.types.is_boolean(data_type):
        return to_arrow(np.array(given, np.bool_), is_missing)
    bits = data_type.bit_width
    low = np.array([value & ((1 << bits) - 1) for value in given], f"u{bits // 8}")
    return to_arrow(low.view(data_type.to_pandas_dtype()), is_missing)


def texts_to_arrow(texts: Sequence[str | None]) -> pa.Array:
    """Return texts; None is NULL."""
    encoded = [b"" if text is None else text.encode() for text in texts]
    offsets = np.zeros(len(texts) + 1, np.int32)
    np.cumsum([len(text) for text in encoded], out=offsets[1:])
    is_missing = np.array([text is None for text in texts], np.bool_)
    valid = _bits(~is_missing) if is_missing.any() else None
    content = pa.py_buffer(b"".join(encoded))
    return pa.Array.from_buffers(pa.string(), len(texts), [valid, pa.py_buffer(offsets), content])


def empty_batch(schema: pa.Schema) -> pa.RecordBatch:
    """Return a batch without rows."""
    nothing = [pa.nulls(0, field.type) for field in schema]
    return pa.RecordBatch.from_arrays(nothing, schema=schema)


def to_numpy(array: pa.Array) -> Values:
    """Return numbers or truth values; what is in the place of NULL means nothing."""
    _, content = array.buffers()
    begin, end = array.offset, array.offset + len(array)
    if content is None:
        return np.zeros(len(array), array.type.to_pandas_dtype())
    if pa.types.is_boolean(array.type):
        return _truths(content, begin, end)
    values: Values = np.frombuffer(content, array.type.to_pandas_dtype())[begin:end]
    return values


def text_lengths(array: pa.Array) -> NDArray[np.int32]:
    """Return the bytes of each text (type string); those of NULL mean nothing."""
    _, offsets, _ = array.buffers()
    if offsets is None:
        return np.zeros(len(array), np.int32)
    begin, end = array.offset, array.offset + len(array)
    return np.diff(np.frombuffer(offsets, np.int32)[begin : end + 1])


def without(array: pa.Array, is_left_out: Truths) -> pa.Array:
    """Return numbers or texts with NULL in place of those that are left out."""
    # Validity is counted from the beginning of the buffers.
    before = np.zeros(array.offset, np.bool_)
    valid = _bits(np.concatenate([before, is_valid(array) & ~is_left_out]))
    return pa.Array.from_buffers(
        array.type, len(array), [valid, *array.buffers()[1:]], offset=array.offset
    )


def is_valid(array: pa.Array) -> Truths:
    """Return which values are not NULL."""
    valid = array.buffers()[0]
    if valid is None:
        return np.full(len(array), array.null_count == 0)
    return _truths(valid, array.offset, array.offset + len(array))


def _bits(truths: Truths) -> pa.Buffer:
    return pa.py_buffer(np.packbits(truths, bitorder="little"))


def _truths(bits: pa.Buffer, begin: int, end: int) -> Truths:
    return np.unpackbits(np.frombuffer(bits, np.uint8), count=end, bitorder="little")[begin:].view(
        np.bool_
    )
