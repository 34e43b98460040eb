"""Arrow types and arrays for fields: which type holds all values, and arrays from numpy."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from msgflow.trace.columns import field_metadata
from msgflow.trace.ctf import field_types as ctf
from msgflow.trace.numpy_arrow import Integers, Values, to_arrow


def arrow_type(declared: ctf.Type) -> pa.DataType:
    """Return the Arrow type; a variant is a structure of all its options, all but one NULL."""
    match declared:
        case ctf.Integer():
            if declared.arrow == "bool":
                return pa.bool_()
            if declared.arrow == "bits":
                return pa.uint64()
            size = next(bits for bits in (8, 16, 32, 64) if bits >= declared.size)
            return pa.type_for_alias(f"int{size}" if declared.signed else f"uint{size}")
        case ctf.VariableInteger():
            return pa.int64() if declared.signed else pa.uint64()
        case ctf.Real():
            return pa.float32() if declared.size == 32 else pa.float64()
        case ctf.String():
            return pa.string()
        case ctf.Array() | ctf.Sequence():
            return pa.string() if declared.is_text else pa.list_(arrow_type(declared.element))
        case ctf.Structure():
            return pa.struct([(m.name, arrow_type(m.type)) for m in declared.members])
        case ctf.Variant():
            return pa.struct([(c.name, arrow_type(c.type)) for c in declared.choices])
        case ctf.Optional():
            return arrow_type(declared.content)


def declared_schema(structure: ctf.Structure) -> pa.Schema:
    """Return the columns of a payload, one for each field, with their bases and labels."""
    return pa.schema(
        [
            pa.field(
                member.name,
                arrow_type(member.type),
                metadata=field_metadata(_base(member.type), getattr(member.type, "labels", None)),
            )
            for member in structure.members
        ]
    )


def _base(declared: ctf.Type) -> int | None:
    if isinstance(declared, ctf.Array | ctf.Sequence):
        return _base(declared.element)
    return declared.base if isinstance(declared, ctf.Integer) else None


def number_array(values: Values, data_type: pa.DataType) -> pa.Array:
    """Return numbers; integers that do not fit wrap round, as in C."""
    return to_arrow(_converted(values, data_type))


def list_array(offsets: Integers, elements: Values, data_type: pa.DataType) -> pa.Array:
    """Return lists of numbers."""
    return pa.ListArray.from_arrays(
        to_arrow(offsets.astype(np.int32)),
        number_array(elements, data_type.value_type),
        type=data_type,
    )


def scattered_array(
    found: list[tuple[Integers, Values]], count: int, data_type: pa.DataType
) -> pa.Array:
    """Return a column in which only some rows have a value.

    `found` has rows with their values, or with a row of elements for each. No row occurs twice.
    """
    is_missing = np.ones(count, np.bool_)
    is_list = pa.types.is_list(data_type)
    element_type = data_type.value_type if is_list else data_type
    sizes = np.zeros(count, np.int64)
    for rows, values in found:
        is_missing[rows] = False
        sizes[rows] = values.shape[1] if is_list else 1
    offsets = np.arange(count + 1)
    if is_list:
        np.cumsum(sizes, out=offsets[1:])
    elements = np.zeros(offsets[-1], element_type.to_pandas_dtype())
    for rows, values in found:
        places = offsets[rows]
        if is_list:
            places = places[:, np.newaxis] + np.arange(values.shape[1])
        elements[places] = _converted(values, element_type)
    if not is_list:
        return to_arrow(elements, is_missing)
    return pa.ListArray.from_arrays(
        to_arrow(offsets.astype(np.int32)),
        to_arrow(elements),
        type=data_type,
        mask=to_arrow(is_missing),
    )


def text_array(offsets: Integers, content: NDArray[np.uint8]) -> pa.Array:
    """Return texts; what is not UTF-8 gets replacement characters."""
    array = pa.StringArray.from_buffers(
        offsets.size - 1,
        pa.py_buffer(offsets.astype(np.int32)),
        pa.py_buffer(np.ascontiguousarray(content)),
    )
    if content.size and int(content.max()) >= 0x80:
        try:
            array.validate(full=True)
        except pa.ArrowInvalid:
            return pa.array(
                [value.as_py().decode("utf-8", "replace") for value in array.cast(pa.binary())],
                pa.string(),
            )
    return array


def _converted(values: Values, data_type: pa.DataType) -> Values:
    if pa.types.is_boolean(data_type):
        is_true: Values = values != 0
        return is_true
    return np.ascontiguousarray(values, dtype=data_type.to_pandas_dtype())
