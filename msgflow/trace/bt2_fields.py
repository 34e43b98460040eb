"""Fields of Babeltrace 2: their Arrow types, and their values as Python objects."""

from __future__ import annotations

from typing import Any

import pyarrow as pa

from msgflow.trace.columns import field_metadata


def schema_of(bt2: Any, structure: Any) -> pa.Schema:
    """Return the members of a structure class as columns; None has no members."""
    fields = []
    for name in structure or ():
        field_class = element = structure[name].field_class
        while isinstance(element, bt2._ArrayFieldClassConst):
            element = element.element_field_class
        labels = None
        if isinstance(field_class, bt2._EnumerationFieldClassConst):
            labels = {
                label: [(part.lower, part.upper) for part in field_class[label].ranges]
                for label in field_class
            }
        metadata = field_metadata(getattr(element, "preferred_display_base", None), labels)
        fields.append(pa.field(str(name), arrow_type(bt2, field_class), metadata=metadata))
    return pa.schema(fields)


def arrow_type(bt2: Any, field_class: Any) -> pa.DataType:
    """Return the Arrow type that holds every value of a field class."""
    if isinstance(field_class, bt2._IntegerFieldClassConst):
        size = next(bits for bits in (8, 16, 32, 64) if bits >= field_class.field_value_range)
        is_signed = isinstance(field_class, bt2._SignedIntegerFieldClassConst)
        return pa.type_for_alias(f"int{size}" if is_signed else f"uint{size}")
    if isinstance(field_class, bt2._StringFieldClassConst):
        return pa.string()
    if isinstance(field_class, bt2._RealFieldClassConst):
        is_single = "SinglePrecision" in type(field_class).__name__
        return pa.float32() if is_single else pa.float64()
    if isinstance(field_class, bt2._BoolFieldClassConst):
        return pa.bool_()
    if isinstance(field_class, bt2._BitArrayFieldClassConst):
        return pa.uint64()
    if isinstance(field_class, bt2._ArrayFieldClassConst):
        return pa.list_(arrow_type(bt2, field_class.element_field_class))
    if isinstance(field_class, bt2._StructureFieldClassConst):
        return pa.struct(schema_of(bt2, field_class))
    if isinstance(field_class, bt2._VariantFieldClassConst):
        # A variant is a structure of all its options; one of them is not NULL.
        options = [field_class.option_at_index(index) for index in range(len(field_class))]
        return pa.struct([(option.name, arrow_type(bt2, option.field_class)) for option in options])
    is_option = isinstance(field_class, bt2._OptionFieldClassConst)
    return arrow_type(bt2, field_class.field_class) if is_option else pa.null()


def value_of(bt2: Any, field: Any) -> Any:
    """Return the value of a field, as its Arrow type holds it; None for no field."""
    if isinstance(field, bt2._IntegerFieldConst):
        return int(field)
    if isinstance(field, bt2._StringFieldConst):
        # Babeltrace before 2.0.5 shows the text of an earlier event in place of an empty one.
        return str(field) if len(field) else ""
    if isinstance(field, bt2._RealFieldConst):
        return float(field)
    if isinstance(field, bt2._BoolFieldConst):
        return bool(field)
    if isinstance(field, bt2._BitArrayFieldConst):
        return field.value_as_integer
    if isinstance(field, bt2._ArrayFieldConst):
        return [value_of(bt2, element) for element in field]
    if isinstance(field, bt2._StructureFieldConst):
        return {str(name): value_of(bt2, member) for name, member in field.items()}
    if isinstance(field, bt2._VariantFieldConst):
        option = field.cls.option_at_index(field.selected_option_index)
        return {option.name: value_of(bt2, field.selected_option)}
    return value_of(bt2, field.field) if isinstance(field, bt2._OptionFieldConst) else None
