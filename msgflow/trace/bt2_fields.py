"""How the fields of an event class are read and which Arrow types they have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pyarrow as pa

if TYPE_CHECKING:
    from collections.abc import Callable

    from msgflow.trace.bt2_library import Bt2Library

_UNSIGNED = {8: pa.uint8(), 16: pa.uint16(), 32: pa.uint32(), 64: pa.uint64()}
_SIGNED = {8: pa.int8(), 16: pa.int16(), 32: pa.int32(), 64: pa.int64()}


@dataclass(frozen=True)
class Member:
    """One member of a structure.

    Attributes:
        name: as declared.
        index: its place in the structure.
        type: the Arrow type that holds every value of it.
        get: a pointer to the field to its value.
        is_hexadecimal: it is, or is an array of, integers to be shown in base 16.
    """

    name: str
    index: int
    type: pa.DataType
    get: Callable[[Any], Any]
    is_hexadecimal: bool


class FieldReader:
    """Derives from a field class what reads its fields.

    Works on Babeltrace's pointers rather than on its Python objects: those cost several times
    as much as the value they hold.
    """

    def __init__(self, library: Bt2Library) -> None:
        self._native = library.native
        self._stale_empty_strings = library.has_stale_empty_strings

    def members(self, structure_class: Any) -> tuple[Member, ...]:
        """List the members of the structure class at this pointer (none for None)."""
        if structure_class is None:
            return ()
        native = self._native
        result = []
        for index in range(native.field_class_structure_get_member_count(structure_class)):
            member = native.field_class_structure_borrow_member_by_index_const(
                structure_class, index
            )
            name = native.field_class_structure_member_get_name(member)
            field_class = native.field_class_structure_member_borrow_field_class_const(member)
            field_type, get = self._reader(field_class)
            is_hexadecimal = self._is_hexadecimal(field_class)
            result.append(Member(name, index, field_type, get, is_hexadecimal))
        return tuple(result)

    def _is_hexadecimal(self, field_class: Any) -> bool:
        native = self._native
        kind = native.field_class_get_type(field_class)
        if native.field_class_type_is(kind, native.FIELD_CLASS_TYPE_ARRAY):
            return self._is_hexadecimal(
                native.field_class_array_borrow_element_field_class_const(field_class)
            )
        if not native.field_class_type_is(kind, native.FIELD_CLASS_TYPE_INTEGER):
            return False
        base = native.field_class_integer_get_preferred_display_base(field_class)
        return bool(base == native.FIELD_CLASS_INTEGER_PREFERRED_DISPLAY_BASE_HEXADECIMAL)

    def _reader(self, field_class: Any) -> tuple[pa.DataType, Callable[[Any], Any]]:
        native = self._native
        kind = native.field_class_get_type(field_class)

        def is_a(other: int) -> bool:
            return bool(native.field_class_type_is(kind, other))

        if is_a(native.FIELD_CLASS_TYPE_UNSIGNED_INTEGER):
            return self._integer(field_class, _UNSIGNED), native.field_integer_unsigned_get_value
        if is_a(native.FIELD_CLASS_TYPE_SIGNED_INTEGER):
            return self._integer(field_class, _SIGNED), native.field_integer_signed_get_value
        if is_a(native.FIELD_CLASS_TYPE_STRING):
            return pa.string(), self._string_reader()
        if is_a(native.FIELD_CLASS_TYPE_SINGLE_PRECISION_REAL):
            return pa.float32(), native.field_real_single_precision_get_value
        if is_a(native.FIELD_CLASS_TYPE_DOUBLE_PRECISION_REAL):
            return pa.float64(), native.field_real_double_precision_get_value
        if is_a(native.FIELD_CLASS_TYPE_BOOL):
            return pa.bool_(), native.field_bool_get_value
        if is_a(native.FIELD_CLASS_TYPE_BIT_ARRAY):
            return pa.uint64(), native.field_bit_array_get_value_as_integer
        if is_a(native.FIELD_CLASS_TYPE_ARRAY):
            return self._array(field_class)
        if is_a(native.FIELD_CLASS_TYPE_STRUCTURE):
            return self._structure(field_class)
        if is_a(native.FIELD_CLASS_TYPE_VARIANT):
            return self._variant(field_class)
        if is_a(native.FIELD_CLASS_TYPE_OPTION):
            return self._option(field_class)
        return pa.null(), lambda field: None

    def _integer(self, field_class: Any, types: dict[int, pa.DataType]) -> pa.DataType:
        bits = self._native.field_class_integer_get_field_value_range(field_class)
        return types[next(size for size in types if size >= bits)]

    def _string_reader(self) -> Callable[[Any], str]:
        get_value: Callable[[Any], str] = self._native.field_string_get_value
        if not self._stale_empty_strings:
            return get_value
        get_length = self._native.field_string_get_length

        def get(field: Any) -> str:
            return get_value(field) if get_length(field) else ""

        return get

    def _array(self, field_class: Any) -> tuple[pa.DataType, Callable[[Any], Any]]:
        native = self._native
        element_type, get_element = self._reader(
            native.field_class_array_borrow_element_field_class_const(field_class)
        )
        get_length = native.field_array_get_length
        borrow = native.field_array_borrow_element_field_by_index_const

        def get(field: Any) -> list[Any]:
            return [get_element(borrow(field, i)) for i in range(get_length(field))]

        return pa.list_(element_type), get

    def _structure(self, field_class: Any) -> tuple[pa.DataType, Callable[[Any], Any]]:
        members = self.members(field_class)
        borrow = self._native.field_structure_borrow_member_field_by_index_const

        def get(field: Any) -> dict[str, Any]:
            return {member.name: member.get(borrow(field, member.index)) for member in members}

        return pa.struct([(member.name, member.type) for member in members]), get

    def _variant(self, field_class: Any) -> tuple[pa.DataType, Callable[[Any], Any]]:
        """A variant is a structure of all its options, of which one is not NULL."""
        native = self._native
        options = []
        for index in range(native.field_class_variant_get_option_count(field_class)):
            option = native.field_class_variant_borrow_option_by_index_const(field_class, index)
            name = native.field_class_variant_option_get_name(option) or f"option_{index}"
            option_class = native.field_class_variant_option_borrow_field_class_const(option)
            options.append((name, *self._reader(option_class)))
        get_index = native.field_variant_get_selected_option_index
        borrow = native.field_variant_borrow_selected_option_field_const

        def get(field: Any) -> dict[str, Any]:
            name, _, get_selected = options[get_index(field)]
            return {name: get_selected(borrow(field))}

        return pa.struct([(name, field_type) for name, field_type, _ in options]), get

    def _option(self, field_class: Any) -> tuple[pa.DataType, Callable[[Any], Any]]:
        native = self._native
        field_type, get_content = self._reader(
            native.field_class_option_borrow_field_class_const(field_class)
        )
        borrow = native.field_option_borrow_field_const

        def get(field: Any) -> Any:
            content = borrow(field)
            return None if content is None else get_content(content)

        return field_type, get
