"""Columns of fields: many events of one class, gathered from memory into numpy arrays."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from msgflow.trace.ctf.event_body import EventBody, Kind, VariantBody
from msgflow.trace.ctf.packet_memory import Memory
from msgflow.trace.numpy_arrow import Integers, Values, distinct

_WIDEST_ROW = 256
_WORD = 8
_MOST_WORDS = 256
_ONES = np.uint64(0x0101010101010101)
_HIGHS = np.uint64(0x8080808080808080)


class FieldRows:
    """The plain fields of events of one class, a row for each event."""

    def __init__(
        self,
        body: EventBody,
        memory: Memory,
        bodies: Integers,
        wanted: Iterable[int],
        *,
        with_variant: bool = False,
    ) -> None:
        """Prepare to read fields.

        `bodies` are the bytes of memory at which contexts and payload of each event begin. `wanted`
        are places in the list of fields. `with_variant` also prepares fields of the variant at the
        end.
        """
        assert body.fields is not None
        self._body = body
        self._fields = body.fields
        # Names of the variant and of an option to the rows that have the option, and its fields.
        self._options: dict[tuple[str, ...], tuple[Integers, FieldRows]] = {}
        self._memory = memory
        self._bodies = bodies
        self._positions: dict[int, Integers] = {}
        self._counts: dict[int, Integers] = {}
        self._rows: Values | None = None
        self._first = 0
        self._offsets: tuple[int, ...] | None = None
        if body.offsets is None:
            self._follow(len(self._fields) - 1 if with_variant else max(wanted, default=-1))
        elif len({tuple(offset) for offset in zip(*body.offsets, strict=True)}) <= 1:
            self._offsets = tuple(offset[0] for offset in body.offsets)
            self._take_rows(wanted)
        else:
            residue = bodies & (len(body.offsets[0]) - 1)
            for number in wanted:
                table = np.array(body.offsets[number], np.int64)
                self._positions[number] = bodies + table[residue]
        if body.variant is not None and with_variant:
            self._find_options(body.variant)

    def words(self, number: int, dtype: str) -> Values:
        """Return the bytes at a field as this type, a value for each row."""
        if self._rows is not None and self._offsets is not None:
            at = self._offsets[number] - self._first
            width = self._rows.itemsize
            if at + np.dtype(dtype).itemsize <= width:
                return np.ndarray(self._rows.shape, dtype, self._rows, at, (width,))
        return self._memory.view(dtype)[self._position(number)]

    def numbers(self, number: int) -> Values:
        """Return the values of a field that is a number."""
        return self.words(number, self._fields[number].dtype)

    def elements(self, number: int) -> tuple[Integers, Values]:
        """Return the elements of an array or sequence: offsets of the rows, and all elements."""
        field = self._fields[number]
        count = self._counts.get(number)
        if count is None:
            count = np.full(self._bodies.size, field.count, np.int64)
        offsets, at = _flat(self._position(number), count, field.width)
        return offsets, self._memory.view(field.dtype)[at]

    def text(self, number: int) -> tuple[Integers, NDArray[np.uint8]]:
        """Return a text, cut at its first NUL: offsets of the rows, and all bytes."""
        offsets, content = self.elements(number)
        content = content.view(np.uint8)
        if self._fields[number].kind is Kind.STRING:
            return offsets, content
        nul = np.append(np.flatnonzero(content == 0), content.size)
        first_nul = nul[np.searchsorted(nul, offsets[:-1])]
        lengths = np.minimum(first_nul, offsets[1:]) - offsets[:-1]
        cut, at = _flat(offsets[:-1], lengths, 1)
        return cut, content[at]

    def in_variant(self, path: tuple[str, ...]) -> tuple[Integers, Values] | None:
        """Return the rows that have a field of the variant, and its values; None if no row has it.

        The values of an array have a column for each element. The path is the names of the
        variants, their options and the structures around the field, and its own.
        """
        rows, option = self._options.get(path[:2], (None, None))
        if rows is None or option is None:
            return None
        number = option._body.places.get(path[2:])
        if number is None:
            inner = option.in_variant(path[2:])
            return None if inner is None else (rows[inner[0]], inner[1])
        field = option._fields[number]
        if field.kind is Kind.NUMBER:
            return rows, option.numbers(number)
        return rows, option.elements(number)[1].reshape(rows.size, field.count)

    def _position(self, number: int) -> Integers:
        if self._offsets is not None:
            return self._bodies + self._offsets[number]
        return self._positions[number]

    def _take_rows(self, wanted: Iterable[int]) -> None:
        """Copy the part of each event that holds the wanted fields, all at once."""
        assert self._offsets is not None
        ends = [
            (self._offsets[number], self._offsets[number] + (self._fields[number].size or 0))
            for number in wanted
        ]
        if len(ends) < 2:
            return
        first, last = min(begin for begin, _ in ends), max(end for _, end in ends)
        if last - first <= _WIDEST_ROW:
            self._first = first
            width = max(last - first, 1)
            self._rows = self._memory.view(f"V{width}")[self._bodies + first]

    def _follow(self, last: int) -> None:
        """Find where fields begin, up to the field `last`, as places vary."""
        at = self._bodies
        for number, field in enumerate(self._fields[: last + 1]):
            if field.align > 1:
                at = (at + (field.align - 1)) & -field.align
            self._positions[number] = at
            if field.size is not None:
                at = at + field.size
            elif field.kind is Kind.STRING:
                self._counts[number] = text_lengths(self._memory, at)
                at = at + self._counts[number] + 1
            else:
                count = self.numbers(field.length_at).astype(np.int64)
                self._counts[number] = count
                at = at + count * field.width

    def _find_options(self, variant: VariantBody) -> None:
        """Find the rows of each option of the variant behind the fields."""
        due = self._position(len(self._fields) - 1)
        values = self.numbers(variant.selector)
        present = distinct(values).tolist()
        for option in variant.options:
            choosing = [value for value in present if variant.option(value) is option]
            if choosing:
                rows = np.flatnonzero(np.isin(values, choosing))
                begins = (due[rows] + (option.align - 1)) & -option.align
                fields = FieldRows(option.body, self._memory, begins, (), with_variant=True)
                self._options[variant.name, option.choice.name] = rows, fields


def text_lengths(memory: Memory, begins: Integers) -> Integers:
    """Return the number of bytes in front of the next NUL; there must be one."""
    lengths = np.zeros(begins.size, np.int64)
    at = begins
    rows = np.arange(begins.size)
    words_at = memory.view("<u8")
    for _ in range(_MOST_WORDS):
        if not rows.size:
            break
        words = words_at[at]
        # The lowest bit that is set marks the first byte that is zero.
        marks = (words - _ONES) & ~words & _HIGHS
        found = marks != 0
        marks = marks[found]
        below = np.bitwise_count((marks & (~marks + np.uint64(1))) - np.uint64(1))
        ended = rows[found]
        lengths[ended] = at[found] - begins[ended] + below // _WORD
        rows, at = rows[~found], at[~found] + _WORD
    # Few texts are longer, if any: one after the other.
    for row, begin in zip(rows.tolist(), at.tolist(), strict=True):
        lengths[row] = memory.data.find(0, begin) - begins[row]
    return lengths


def _flat(begins: Integers, counts: Integers, width: int) -> tuple[Integers, Integers]:
    """Return offsets of rows among all their elements, and where each element begins."""
    offsets = np.zeros(counts.size + 1, np.int64)
    np.cumsum(counts, out=offsets[1:])
    at = np.arange(offsets[-1]) * width
    at += np.repeat(begins - offsets[:-1] * width, counts)
    return offsets, at
