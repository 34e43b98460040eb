"""Which Arrow type holds every value of a field."""

from __future__ import annotations

import pyarrow as pa

from msgflow.trace.columns import BASE
from msgflow.trace.ctf.types import (
    Array,
    Integer,
    Optional,
    Real,
    Sequence,
    String,
    Structure,
    Type,
    VariableInteger,
    Variant,
)

_UNSIGNED = {8: pa.uint8(), 16: pa.uint16(), 32: pa.uint32(), 64: pa.uint64()}
_SIGNED = {8: pa.int8(), 16: pa.int16(), 32: pa.int32(), 64: pa.int64()}


def arrow_type(declared: Type) -> pa.DataType:
    """Return the type; a variant is a structure of all its options, of which one is not NULL."""
    match declared:
        case Integer():
            if declared.arrow == "bool":
                return pa.bool_()
            if declared.arrow == "bits":
                return pa.uint64()
            types = _SIGNED if declared.signed else _UNSIGNED
            return types[next(size for size in types if size >= declared.size)]
        case VariableInteger():
            return pa.int64() if declared.signed else pa.uint64()
        case Real():
            return pa.float32() if declared.size == 32 else pa.float64()
        case String():
            return pa.string()
        case Array() | Sequence():
            return pa.string() if declared.is_text else pa.list_(arrow_type(declared.element))
        case Structure():
            return pa.struct([(m.name, arrow_type(m.type)) for m in declared.members])
        case Variant():
            return pa.struct([(c.name, arrow_type(c.type)) for c in declared.choices])
        case Optional():
            return arrow_type(declared.content)


def declared_schema(structure: Structure) -> pa.Schema:
    """Return the columns of a payload, all its fields; integers of base 16 are marked."""
    return pa.schema(
        [
            pa.field(
                member.name,
                arrow_type(member.type),
                metadata={BASE: b"16"} if _is_hexadecimal(member.type) else None,
            )
            for member in structure.members
        ]
    )


def _is_hexadecimal(declared: Type) -> bool:
    if isinstance(declared, Array | Sequence):
        return _is_hexadecimal(declared.element)
    return isinstance(declared, Integer) and declared.base == 16
