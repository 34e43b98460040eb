"""Finds and reads event headers by the compiled kernel, where it knows the layout."""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from msgflow import kernel
from msgflow.trace.ctf.event_body import Kind
from msgflow.trace.ctf.headers import Headers
from msgflow.trace.ctf.scan import Scanned
from msgflow.trace.ctf.walk import FieldError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from msgflow.trace.ctf.event_body import EventBody
    from msgflow.trace.ctf.event_header import Form, Place
    from msgflow.trace.ctf.layout import Span, StreamLayout
    from msgflow.trace.ctf.memory import Memory

_WIDEST_TABLE = 1 << 16
_LARGEST_SIZE = 1 << 30
_ROOM = 1 << 16
_KINDS = {Kind.NOTHING: 0, Kind.NUMBER: 1, Kind.STRING: 2, Kind.SEQUENCE: 3}


class UnusualError(Exception):
    """The kernel does not know such a layout."""


class CompiledLayout:
    """A stream class as the kernel knows it."""

    def __init__(self, library: ctypes.CDLL, layout: StreamLayout) -> None:
        """Describe it to the kernel.

        Raises:
            UnusualError: it has something that only Python reads.
        """
        self._library = library
        header = layout.header
        if header is None or header.selector.mask >= _WIDEST_TABLE:
            raise UnusualError
        if header.narrow_bits is not None and any(form.time is None for form in header.forms):
            raise UnusualError
        if len(header.forms) >= kernel.NO_FORM or max(layout.classes, default=0) >= _WIDEST_TABLE:
            raise UnusualError
        forms = (kernel.Form * len(header.forms))(*map(_form, header.forms))
        form_of = np.full(header.selector.mask + 1, kernel.NO_FORM, np.uint8)
        for number, form in reversed(list(enumerate(header.forms))):
            for first, last in form.choice.ranges if form.choice else [(0, header.selector.mask)]:
                form_of[max(first, 0) : max(last + 1, 0)] = number
        body_of = np.full(max(layout.classes, default=0) + 1, -1, np.int32)
        steps: list[kernel.Step] = []
        bodies: list[kernel.Body] = []
        for event_id, known in layout.classes.items():
            if event_id < 0:
                raise UnusualError
            body_of[event_id] = len(bodies)
            first_step = len(steps)
            steps += _steps(known.body)
            sizes = _small(known.body.sizes or ())
            bodies.append(
                kernel.Body(known.number, first_step, len(steps) - first_step, _by_residue(sizes))
            )
        self._kept = (
            forms,
            form_of,
            (kernel.Body * len(bodies))(*bodies),
            body_of,
            (kernel.Step * len(steps))(*steps),
        )
        addresses = [
            part.ctypes.data if isinstance(part, np.ndarray) else ctypes.addressof(part)
            for part in self._kept
        ]
        self._description = kernel.Layout(
            layout.residues,
            header.align,
            form_of.size,
            body_of.size,
            layout.only_id,
            _place(header.selector),
            *addresses,
        )
        self._address = ctypes.addressof(self._description)

    def scan(self, layout: StreamLayout, memory: Memory, span: Span) -> Scanned:
        """Find the events of a packet; it is the layout that was described."""
        parts: list[NDArray[np.int64]] = []
        position = ctypes.c_int64(span.begin)
        problem = None
        while position.value < span.end:
            found = np.empty(_ROOM, np.int64)
            count = self._library.msgflow_scan(
                self._address,
                memory.bytes.ctypes.data,
                memory.bytes.size,
                span.limit,
                span.end,
                ctypes.byref(position),
                found.ctypes.data,
                found.size,
            )
            parts.append(found[:count].copy())
            if count < found.size and position.value < span.end:
                at = position.value
                try:
                    position.value = layout.next_event(memory.data, at, span)
                    parts.append(np.array([at]))
                except FieldError as error:
                    problem = (at, str(error))
                    break
        return Scanned(np.concatenate([*parts, np.empty(0, np.int64)]), problem)

    def headers(
        self,
        memory: Memory,
        positions: NDArray[np.int64],
        counts: NDArray[np.int64],
        befores: NDArray[np.uint64],
    ) -> Headers:
        """Read the headers of events, as `read_headers` does."""
        classes = np.empty(positions.size, np.uint32)
        clock = np.empty(positions.size, np.uint64)
        bodies = np.empty(positions.size, np.int64)
        begin = 0
        for count, before in zip(counts.tolist(), befores.tolist(), strict=True):
            read = self._library.msgflow_headers(
                self._address,
                memory.bytes.ctypes.data,
                memory.bytes.size,
                positions[begin:].ctypes.data,
                count,
                before,
                classes[begin:].ctypes.data,
                clock[begin:].ctypes.data,
                bodies[begin:].ctypes.data,
            )
            assert read == count
            begin += count
        return Headers(classes, clock, bodies)


def compiled(layout: StreamLayout) -> CompiledLayout | None:
    """Return the layout for the kernel; None where there is none, or it does not know such."""
    library = kernel.library()
    if library is None:
        return None
    if layout not in _compiled:
        try:
            _compiled[layout] = CompiledLayout(library, layout)
        except UnusualError:
            _compiled[layout] = None
    return _compiled[layout]


_compiled: WeakKeyDictionary[StreamLayout, CompiledLayout | None] = WeakKeyDictionary()


def _small(sizes: Iterable[int]) -> tuple[int, ...]:
    sizes = tuple(sizes)
    if any(not 0 <= size < _LARGEST_SIZE for size in sizes):
        raise UnusualError
    return sizes


def _by_residue(sizes: tuple[int, ...]) -> ctypes.Array[ctypes.c_int64]:
    return (ctypes.c_int64 * kernel.RESIDUES)(*sizes)


def _place(place: Place | None) -> kernel.Place:
    if place is None:
        return kernel.Place()
    offsets = _by_residue(_small(place.offsets))
    return kernel.Place(place.width, place.big_endian, place.shift, place.mask, offsets)


def _form(form: Form) -> kernel.Form:
    return kernel.Form(
        form.id is not None,
        0 if form.time is None else form.time.mask,
        _place(form.id),
        _place(form.time),
        _by_residue(_small(form.sizes)),
    )


def _steps(body: EventBody) -> list[kernel.Step]:
    """Return the steps to the end of a body, none if its size is known."""
    if body.sizes is not None:
        return []
    if body.fields is None or body.tail is not None:
        raise UnusualError
    slots: dict[int, int] = {}
    steps = []
    for align, size, kind, number in body.steps:
        _small((align, size))
        slot = 0
        if kind is Kind.NUMBER:
            slot = slots.setdefault(number, len(slots))
        elif kind is Kind.SEQUENCE:
            slot = slots[number]
        big_endian = kind is Kind.NUMBER and body.fields[number].dtype[0] == ">"
        steps.append(kernel.Step(align, size, _KINDS[kind], slot, big_endian))
    if len(slots) > kernel.LENGTHS:
        raise UnusualError
    return steps
