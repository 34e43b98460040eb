"""Splits events by class and gathers their numbers by the compiled kernel."""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

import numpy as np

from msgflow import kernel
from msgflow.trace.ctf.event_body import Kind

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from msgflow.trace.ctf.event_body import EventBody, PlainField
    from msgflow.trace.ctf.memory import Memory

_LARGEST_OFFSET = 1 << 30
_MOST_TEXTS = 1 << 12
_LONGEST_TEXT = 256


def split(
    classes: NDArray[np.uint32], class_count: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]] | None:
    """Return rows class after class, and where each class ends among them.

    Args:
        classes: number of the class of each row.
        class_count: numbers are below it.

    Returns:
        None without a kernel.
    """
    library = kernel.library()
    if library is None:
        return None
    ends = np.zeros(class_count, np.int64)
    rows = np.empty(classes.size, np.int64)
    count = library.msgflow_split(
        classes.ctypes.data,
        classes.size,
        class_count,
        ends.ctypes.data,
        rows.ctypes.data,
    )
    assert count == classes.size
    return rows, ends


class Texts:
    """Texts of one length, numbered from 0 as they are first seen."""

    def __init__(self, length: int) -> None:
        self._known = np.empty((_MOST_TEXTS, length), np.uint8)
        self._slots = np.full(4 * _MOST_TEXTS, -1, np.int32)
        self.description = kernel.Texts(
            length,
            _MOST_TEXTS,
            0,
            self._slots.size,
            known=self._known.ctypes.data,
            slots=self._slots.ctypes.data,
        )

    def after(self, number: int) -> list[bytes]:
        """Return the texts from this number on."""
        return [text.tobytes() for text in self._known[number : self.description.count]]


class Gatherer:
    """What is wanted of events of one class and laid out so that the kernel gathers it."""

    def __init__(
        self, body: EventBody, wanted: Iterable[tuple[int, np.dtype[Any]]], text: int | None
    ) -> None:
        """Work it out.

        Args:
            body: how the events are laid out.
            wanted: places in the list of fields, and types: integers that do not fit wrap round.
            text: place in the list of fields of a text that is to be numbered.
        """
        offsets = body.offsets or ()
        fields = body.fields or ()
        self._residues = len(offsets[0]) if offsets else 1
        self.numbers = [
            (number, dtype)
            for number, dtype in dict.fromkeys(wanted)
            if offsets and _is_gathered(fields[number], offsets[number], dtype)
        ]
        self._columns = (kernel.Column * len(self.numbers))(
            *(_column(fields[number], offsets[number], dtype) for number, dtype in self.numbers)
        )
        self.text = text if offsets and text is not None and _is_text(fields[text]) else None
        self.text_length = 0
        self._text_offsets = (ctypes.c_int64 * kernel.RESIDUES)()
        if self.text is not None:
            self.text_length = fields[self.text].count
            self._text_offsets = (ctypes.c_int64 * kernel.RESIDUES)(*offsets[self.text])

    def gather(
        self, memory: Memory, bodies: NDArray[np.int64], texts: Texts | None
    ) -> tuple[list[NDArray[Any]], NDArray[np.int32]] | None:
        """Return the numbers, and the numbers of the texts.

        Args:
            memory: where the events lie.
            bodies: where contexts and payload of each begin.
            texts: those seen so far of `text_length`; None: they are not wanted.

        Returns:
            None without a kernel, or where it gives up.
        """
        library = kernel.library()
        if library is None:
            return None
        found = [np.empty(bodies.size, dtype) for _, dtype in self.numbers]
        text_numbers = np.empty(bodies.size if texts else 0, np.int32)
        for column, values in zip(self._columns, found, strict=True):
            column.out = values.ctypes.data
        if texts:
            texts.description.offsets = self._text_offsets
            texts.description.out = text_numbers.ctypes.data
        count = library.msgflow_gather(
            memory.bytes.ctypes.data,
            memory.bytes.size,
            self._residues,
            bodies.ctypes.data,
            bodies.size,
            self._columns,
            len(found),
            ctypes.byref(texts.description) if texts else None,
        )
        return (found, text_numbers) if count == bodies.size else None


def _is_gathered(field: PlainField, offsets: Sequence[int], dtype: np.dtype[Any]) -> bool:
    given = np.dtype(field.dtype)
    are_integers = given.kind in "iu" and dtype.kind in "iu"
    return (
        field.kind is Kind.NUMBER
        and max(offsets) < _LARGEST_OFFSET
        and (are_integers or given.newbyteorder("=") == dtype)
    )


def _is_text(field: PlainField) -> bool:
    return field.kind is Kind.TEXT and field.width == 1 and 0 < field.count <= _LONGEST_TEXT


def _column(field: PlainField, offsets: Sequence[int], dtype: np.dtype[Any]) -> kernel.Column:
    return kernel.Column(
        field.width,
        field.dtype[0] == ">",
        field.dtype[1] == "i",
        dtype.itemsize,
        (ctypes.c_int64 * kernel.RESIDUES)(*offsets),
    )
