"""The fields of many events of one class, gathered from memory into numpy arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from msgflow.trace.ctf.event_body import EventBody, Kind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from msgflow.trace.ctf.memory import Memory

_WIDEST_ROW = 256
_WORD = 8
_ONES = np.uint64(0x0101010101010101)
_HIGHS = np.uint64(0x8080808080808080)


class FieldRows:
    """The plain fields of events of one class."""

    def __init__(
        self, body: EventBody, memory: Memory, bodies: NDArray[np.int64], wanted: Iterable[int]
    ) -> None:
        """Look at the bodies that begin at `bodies`; `wanted` are the fields that will be read."""
        assert body.fields is not None
        self._fields = body.fields
        self._memory = memory
        self._bodies = bodies
        self._positions: dict[int, NDArray[np.int64]] = {}
        self._counts: dict[int, NDArray[np.int64]] = {}
        self._rows: NDArray[Any] | None = None
        self._first = 0
        self._offsets: tuple[int, ...] | None = None
        if body.offsets is None:
            self._walk(max(wanted, default=-1))
        elif len({tuple(offset) for offset in zip(*body.offsets, strict=True)}) <= 1:
            self._offsets = tuple(offset[0] for offset in body.offsets)
            self._take_rows(wanted)
        else:
            residue = bodies & (len(body.offsets[0]) - 1)
            for number in wanted:
                table = np.array(body.offsets[number], np.int64)
                self._positions[number] = bodies + table[residue]

    def words(self, number: int, dtype: str, offset: int = 0) -> NDArray[Any]:
        """Return what lies at a field, or so many bytes behind its begin, as this type."""
        if self._rows is not None and self._offsets is not None:
            at = self._offsets[number] + offset - self._first
            if at + np.dtype(dtype).itemsize <= self._rows.dtype.itemsize:
                column = np.dtype(
                    {
                        "names": ["word"],
                        "formats": [dtype],
                        "offsets": [at],
                        "itemsize": self._rows.dtype.itemsize,
                    }
                )
                return self._rows.view(column)["word"]
        return self._memory.view(dtype)[self._position(number) + offset]

    def numbers(self, number: int) -> NDArray[Any]:
        """Return the values of a number."""
        return self.words(number, self._fields[number].dtype)

    def elements(self, number: int) -> tuple[NDArray[np.int64], NDArray[Any]]:
        """Return the elements of an array or sequence: offsets of the rows, and all elements."""
        field = self._fields[number]
        count = self._counts.get(number)
        if count is None:
            count = np.full(self._bodies.size, field.count, np.int64)
        offsets, at = _flat(self._position(number), count, field.width)
        return offsets, self._memory.view(field.dtype)[at]

    def text(self, number: int) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
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

    def _position(self, number: int) -> NDArray[np.int64]:
        if self._offsets is not None:
            return self._bodies + self._offsets[number]
        return self._positions[number]

    def _take_rows(self, wanted: Iterable[int]) -> None:
        """Take the part of each event that holds the wanted fields, in one go."""
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

    def _walk(self, last: int) -> None:
        """Find where fields begin whose place varies, up to the field `last`."""
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


def text_lengths(memory: Memory, begins: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how many bytes there are in front of the next NUL; there must be one."""
    lengths = np.zeros(begins.size, np.int64)
    at = begins
    rows = np.arange(begins.size)
    words_at = memory.view("<u8")
    while rows.size:
        words = words_at[at]
        # The lowest bit that is set marks the first byte that is zero.
        marks = (words - _ONES) & ~words & _HIGHS
        found = marks != 0
        marks = marks[found]
        below = np.bitwise_count((marks & (~marks + np.uint64(1))) - np.uint64(1))
        ended = rows[found]
        lengths[ended] = at[found] - begins[ended] + below // _WORD
        rows, at = rows[~found], at[~found] + _WORD
    return lengths


def _flat(
    begins: NDArray[np.int64], counts: NDArray[np.int64], width: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return offsets of rows among all their elements, and where each element begins."""
    offsets = np.zeros(counts.size + 1, np.int64)
    np.cumsum(counts, out=offsets[1:])
    at = np.arange(offsets[-1]) * width
    at += np.repeat(begins - offsets[:-1] * width, counts)
    return offsets, at
