"""Layout of a stream class: how to find and read its events."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from msgflow.trace.ctf.declarations import Clock, EventClass, StreamClass, TraceClass
from msgflow.trace.ctf.event_body import EventBody, compile_body
from msgflow.trace.ctf.event_header import EventHeader, Form, compile_header
from msgflow.trace.ctf.field_reader import EventReader
from msgflow.trace.ctf.field_types import BYTE, FieldError, Type, aligned, parts
from msgflow.trace.numpy_arrow import Integers

GAP = 64
"""Bytes of ones that follow a packet in memory; packets begin at multiples of it."""

_MOST_RESIDUES = 8
_LONGEST_TABLE = 1 << 16


@dataclass(frozen=True)
class Span:
    """Where the events of a packet lie in memory, in bytes."""

    base: int  # the begin of the packet
    begin: int  # where the first event begins
    end: int  # where the next header would begin after the last event
    limit: int  # the end of the content, not after `end`


@dataclass(frozen=True, eq=False)
class ClassLayout:
    """An event class and how to read it."""

    number: int  # its place among all classes of a set of traces
    event: EventClass  # what is declared
    body: EventBody  # how to read it


class StreamLayout:
    """How to find the events of one stream class."""

    def __init__(
        self, trace_index: int, trace: TraceClass, stream: StreamClass, first_number: int
    ) -> None:
        self.trace_index = trace_index
        self.trace = trace
        self.stream = stream
        structures = [stream.event_header, stream.event_context]
        for event in stream.events.values():
            structures += [event.specific_context, event.payload]
        align = max(BYTE, *map(largest_align, structures))
        # Events whose positions differ by a multiple of this have the same layout.
        self.residues = min(align // BYTE, _MOST_RESIDUES)
        # How to read many event headers at once; None: they are read field by field.
        self.header: EventHeader | None = None
        # From selector * `residues` + residue to the body behind such a header, and the header's
        # size in bytes.
        self._short_forms: dict[int, tuple[EventBody, int]] = {}
        if align // BYTE <= _MOST_RESIDUES:
            self.header = compile_header(stream, self.residues)
        forms = () if self.header is None else self.header.forms
        if any(max(form.sizes) > GAP for form in forms):
            # Reading it all at once might go beyond the end of the memory.
            self.header = None
        # Event class id to layout.
        self.classes = {
            event_id: ClassLayout(number, event, compile_body(stream, event, self.residues))
            for number, (event_id, event) in enumerate(stream.events.items(), first_number)
        }

    @property
    def clock(self) -> Clock:
        """The clock of the stream class; traces in which one has none are refused, or given one."""
        assert self.stream.clock is not None
        return self.stream.clock

    def span(self, base: int, events_at: int, content_bits: int) -> Span:
        """Return where events lie in a packet at the byte `base`; needs `header`."""
        align = self.known_header.align * BYTE
        begin = base + aligned(events_at, align) // BYTE
        end = base + aligned(content_bits, align) // BYTE
        return Span(base, min(begin, end), end, base + (content_bits + BYTE - 1) // BYTE)

    @cached_property
    def known_header(self) -> EventHeader:
        """`header`, where events are not read field by field."""
        assert self.header is not None
        return self.header

    @cached_property
    def only_id(self) -> int:
        """Id of events whose headers have no id."""
        return next(iter(self.classes)) if len(self.classes) == 1 else 0

    @cached_property
    def sizes_by_selector(self) -> list[dict[int, int]]:
        """Sizes of events in bytes, including the padding in front of the next header.

        For each residue of the event's position, a dictionary from the selector, shifted as it
        lies in its word, to the size. Events whose size varies are not in it.
        """
        header, selector = self.known_header, self.known_header.selector
        sizes: list[dict[int, int]] = [{} for _ in range(self.residues)]
        for event_id, layout in self.classes.items():
            form = self._form_of(event_id)
            is_short = form is not None and form.id == selector and 0 <= event_id <= selector.mask
            if form is None or not is_short or layout.body.sizes is None:
                continue
            for residue, of_residue in enumerate(sizes):
                body_at = residue + form.sizes[residue]
                end = body_at + layout.body.sizes[body_at % self.residues]
                size = aligned(end, header.align) - residue
                if size:
                    of_residue[event_id << selector.shift] = size
        return sizes

    @cached_property
    def size_table(self) -> Integers | None:
        """`sizes_by_selector` as an array by selector and residue, 0 where they have none.

        The last row has none: larger selectors are looked up there. None if there are too many
        selectors, or if one of ones only is a class: ones follow the last event.
        """
        shift, mask = self.known_header.selector.shift, self.known_header.selector.mask
        sizes = [
            {key >> shift: size for key, size in of_residue.items()}
            for of_residue in self.sizes_by_selector
        ]
        rows = max((selector for of_residue in sizes for selector in of_residue), default=0) + 2
        if rows > _LONGEST_TABLE or any(mask in of_residue for of_residue in sizes):
            return None
        table = np.zeros((rows, self.residues), np.int64)
        for residue, of_residue in enumerate(sizes):
            for selector, size in of_residue.items():
                table[selector, residue] = size
        return table

    def _form_of(self, selector: int) -> Form | None:
        """Return the form of a header with this selector."""
        return next((form for form in self.known_header.forms if form.holds(selector)), None)

    def next_event(self, data: bytearray, position: int, span: Span) -> int:
        """Return where the event after the one at this byte begins."""
        header = self.known_header
        residue = position % self.residues
        selector = header.selector.read(data, position, residue)
        key = selector * self.residues + residue
        found = self._short_forms.get(key)
        if found is None:
            form = self._form_of(selector)
            if form is None:
                raise FieldError(f"there is no form of an event header for {selector}")
            event_id = form.id.read(data, position, residue) if form.id else self.only_id
            layout = self.classes.get(event_id)
            if layout is None:
                raise FieldError(f"there is no event class {event_id}")
            found = layout.body, form.sizes[residue]
            if form.id is None or form.id == header.selector:
                self._short_forms[key] = found
        body, header_size = found
        body_at = position + header_size
        if body_at > span.limit:
            raise FieldError("an event goes beyond the end of the packet")
        if body.sizes is not None:
            end = body_at + body.sizes[body_at % self.residues]
        elif body.fields is not None:
            end = body.end(data, body_at, span.limit)
        else:
            content = memoryview(data)[span.base : span.limit]
            reader = EventReader(self.trace, self.stream, content, len(content) * BYTE)
            end = span.base + (reader.event_end((position - span.base) * BYTE) + BYTE - 1) // BYTE
        if end > span.limit or end == position:
            raise FieldError("an event goes beyond the end of the packet")
        return aligned(end, header.align)


def largest_align(declared: Type) -> int:
    """Return the largest alignment of a type and everything in it, in bits."""
    return max(declared.align, *map(largest_align, parts(declared)), 1)
