"""Traces of any layout: byte orders, alignments, headers, and fields of every type.

The metadata is TSDL as LTTng and others write it; the streams are written bit by bit.
"""

from __future__ import annotations

import struct
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from support.bit_writer import BitWriter

UUID = uuid.UUID("aaaaaaaa-bbbb-cccc-dddd-eeeeeeeeeeee")
_TEXTS = (b"", b"a", b"node", b"/chatter", "Bücher".encode(), b"x" * 70, b"\xff\xfe", b"12345678")
_STEPS = (0, 1, 1000, 1 << 26, (1 << 27) - 1, 1 << 31, (1 << 32) + 5)


@dataclass(frozen=True)
class Style:
    """What all fields of a trace have in common."""

    big_endian: bool
    natural: bool
    compact: bool
    bit_packed: bool


@dataclass(frozen=True)
class Field:
    """A field.

    Attributes:
        name: as TSDL has it.
        before: its type in TSDL, what stands in front of the name.
        after: what stands behind the name.
        align: in bits.
        write: writes a value.
    """

    name: str
    before: str
    after: str
    align: int
    write: Callable[[BitWriter], Any]

    def text(self, name: str | None = None) -> str:
        return f"{self.before} {name or self.name}{self.after};"


def alignment(fields: Sequence[Field]) -> int:
    return max([1, *(f.align for f in fields)])


def write_all(fields: Sequence[Field], writer: BitWriter) -> None:
    writer.align(alignment(fields))
    for each in fields:
        each.write(writer)


def structure_text(fields: Sequence[Field]) -> str:
    return f"struct {{ {' '.join(f.text() for f in fields)} }}"


class LayoutMaker:
    """Makes fields of one style."""

    def __init__(self, style: Style, random: Random) -> None:
        self.style = style
        self.random = random
        self._names = 0

    def structure(self, depth: int, most: int = 5) -> list[Field]:
        kinds: list[Callable[[], list[Field]]] = [
            *[self._integer] * 4,
            self._real,
            self._string,
            self._string,
            self._text,
            self._array,
            self._sequence,
        ]
        if depth:
            kinds += [
                lambda: self._nested(depth - 1),
                lambda: self._variant(depth - 1),
                lambda: self._nested_array(depth - 1),
            ]
        fields = []
        for _ in range(self.random.randint(0, most)):
            fields.extend(self.random.choice(kinds)())
        return fields

    def align_of(self, size: int) -> int:
        if size % 8 and self.style.bit_packed:
            return 1
        return size if self.style.natural and size in {8, 16, 32, 64} else 8

    def number(self, size: int, align: int | None = None, more: str = "") -> str:
        align = self.align_of(size) if align is None else align
        return f"integer {{ size = {size}; align = {align}; {more} }}"

    def _name(self) -> str:
        self._names += 1
        return f"_f{self._names}" if self.random.random() < 0.9 else f"__f{self._names}"

    def _any_number(self) -> Field:
        random = self.random
        size = random.choice(
            [8, 16, 32, 64] + [1, 3, 5, 12, 24, 27, 33, 63] * self.style.bit_packed
        )
        align = self.align_of(size)
        if random.random() < 0.3:
            align = 1
        big, more = self.style.big_endian, ""
        if not self.style.bit_packed and random.random() < 0.2:
            big = not big
            more = f"byte_order = {'be' if big else 'le'};"
        more += f"signed = {random.choice(['true', 'false'])};"

        def write(writer: BitWriter) -> None:
            value = random.choice([0, 1, (1 << size) - 1, random.getrandbits(size)])
            writer.integer(value & ((1 << size) - 1), size, align, big)

        return Field(self._name(), self.number(size, align, more), "", align, write)

    def _integer(self) -> list[Field]:
        return [self._any_number()]

    def _real(self) -> list[Field]:
        size, exponent, mantissa = self.random.choice([(32, 8, 24), (64, 11, 53)])
        align, big = self.align_of(size), self.style.big_endian

        def write(writer: BitWriter) -> None:
            value = self.random.choice([0.0, -1.5, 1e30, 0.25])
            content = struct.pack(">f" if size == 32 else ">d", value)
            writer.integer(int.from_bytes(content, "big"), size, align, big)

        before = (
            f"floating_point {{ exp_dig = {exponent}; mant_dig = {mantissa}; align = {align}; }}"
        )
        return [Field(self._name(), before, "", align, write)]

    def _string(self) -> list[Field]:
        def write(writer: BitWriter) -> None:
            writer.bytes(self.random.choice(_TEXTS) + b"\0")

        return [Field(self._name(), "string { encoding = UTF8; }", "", 8, write)]

    def _text(self) -> list[Field]:
        length = self.random.choice([1, 7, 8, 9, 16, 17])

        def write(writer: BitWriter) -> None:
            writer.bytes(self.random.choice(_TEXTS)[:length].ljust(length, b"\0"))

        before = self.number(8, 8, "signed = true; encoding = UTF8;")
        return [Field(self._name(), before, f"[{length}]", 8, write)]

    def _array(self) -> list[Field]:
        element, length = self._any_number(), self.random.randint(0, 5)

        def write(writer: BitWriter) -> None:
            writer.align(element.align)
            for _ in range(length):
                element.write(writer)

        return [Field(element.name, element.before, f"[{length}]", element.align, write)]

    def _sequence(self) -> list[Field]:
        length = 0
        size = self.random.choice([8, 16, 32])
        element = self._any_number()
        if self.random.random() < 0.3:
            before = self.number(8, 8, "encoding = UTF8;")
            element = Field(
                element.name, before, "", 8, lambda w: w.bytes(self.random.choice([b"a", b"\0"]))
            )

        def write_length(writer: BitWriter) -> None:
            nonlocal length
            length = self.random.choice([0, 0, 1, 2, 5])
            writer.integer(length, size, self.align_of(size), self.style.big_endian)

        def write(writer: BitWriter) -> None:
            writer.align(element.align)
            for _ in range(length):
                element.write(writer)

        name = f"_{element.name}_length"
        return [
            Field(name, self.number(size), "", self.align_of(size), write_length),
            Field(element.name, element.before, f"[{name}]", element.align, write),
        ]

    def _nested(self, depth: int) -> list[Field]:
        members = self.structure(depth, 3)
        return [
            Field(
                self._name(),
                structure_text(members),
                "",
                alignment(members),
                lambda writer: write_all(members, writer),
            )
        ]

    def _nested_array(self, depth: int) -> list[Field]:
        members, length = self.structure(depth, 2), self.random.randint(0, 3)

        def write(writer: BitWriter) -> None:
            writer.align(alignment(members))
            for _ in range(length):
                write_all(members, writer)

        before = structure_text(members)
        return [Field(self._name(), before, f"[{length}]", alignment(members), write)]

    def _variant(self, depth: int) -> list[Field]:
        makers = [self._integer, self._real, self._string, self._text, self._array]
        options = [self.random.choice(makers)()[0] for _ in range(2)]
        options += self._nested(depth)
        chosen = 0
        size = self.random.choice([8, 16])

        def write_tag(writer: BitWriter) -> None:
            nonlocal chosen
            chosen = self.random.randrange(len(options))
            writer.integer(chosen * 10, size, self.align_of(size), self.style.big_endian)

        labels = ", ".join(f"o{n} = {n * 10} ... {n * 10 + 3}" for n in range(len(options)))
        inner = " ".join(option.text(f"o{n}") for n, option in enumerate(options))
        tag = self._name()
        before = f"enum : {self.number(size)} {{ {labels} }}"
        return [
            Field(tag, before, "", self.align_of(size), write_tag),
            Field(
                self._name(),
                f"variant <{tag}> {{ {inner} }}",
                "",
                1,
                lambda writer: options[chosen].write(writer),
            ),
        ]


class TraceMaker:
    """Writes a trace of random event classes and events."""

    def __init__(self, style: Style, random: Random) -> None:
        self._style = style
        self._random = random
        self._maker = LayoutMaker(style, random)
        self._context = self._maker.structure(0, 2)
        count = random.choice([1, 3, 6])
        self._classes = [self._maker.structure(2) for _ in range(count)]

    def write(
        self, directory: Path, streams: int = 2, packets: int = 3, latest_begin: int = 1 << 40
    ) -> Path:
        directory.mkdir(parents=True)
        (directory / "metadata").write_text(self._metadata())
        for instance in range(streams):
            clock = self._random.randrange(latest_begin)
            data, index = b"", struct.pack(">IIII", 0xC1F1DCC1, 1, 1, 72)
            for sequence in range(self._random.randint(1, packets)):
                begin, offset = clock, len(data)
                content, used, clock = self._packet(instance, sequence, clock)
                data += content
                numbers = (offset, len(content) * 8, used, begin, clock, 0, 7, instance, sequence)
                index += struct.pack(">9Q", *numbers)
            (directory / f"stream_{instance}").write_bytes(data)
            (directory / "index").mkdir(exist_ok=True)
            (directory / "index" / f"stream_{instance}.idx").write_bytes(index)
        return directory

    def _metadata(self) -> str:
        number = self._maker.number
        time = "map = clock.monotonic.value;"
        sizes, aligns = ((5, 27), (1, 1)) if self._style.compact else ((16, 32), (None, None))
        last = (1 << sizes[0]) - 1
        header = f"""struct {{
            enum : {number(sizes[0], aligns[0])} {{
                compact = 0 ... {last - 1}, extended = {last} }} id;
            variant <id> {{
                struct {{ {number(sizes[1], aligns[1], time)} timestamp; }} compact;
                struct {{ {number(32)} id; {number(64, None, time)} timestamp; }} extended;
            }} v;
        }} align({self._header_align})"""
        events = "\n".join(
            f"""event {{ id = {n}; name = "test:e{n}"; stream_id = 7;
            fields := {structure_text(members)}; }};"""
            for n, members in enumerate(self._classes)
        )
        return f"""/* CTF 1.8 */
        trace {{ major = 1; minor = 8; uuid = "{UUID}";
            byte_order = {"be" if self._style.big_endian else "le"};
            packet.header := struct {{
                {number(32)} magic; {number(8)} uuid[16]; {number(32)} stream_id;
                {number(64)} stream_instance_id; }}; }};
        clock {{ name = monotonic; freq = 1000000000; offset = 1600000000000000000; }};
        stream {{ id = 7;
            packet.context := struct {{
                {number(64, None, time)} timestamp_begin; {number(64, None, time)} timestamp_end;
                {number(64)} content_size; {number(64)} packet_size; {number(64)} packet_seq_num;
                {number(32)} events_discarded; {number(32)} cpu_id; }};
            event.header := {header};
            event.context := {structure_text(self._context)}; }};
        {events}"""

    @property
    def _header_align(self) -> int:
        return self._maker.align_of(32 if self._style.compact else 16)

    def _packet(self, instance: int, sequence: int, clock: int) -> tuple[bytes, int, int]:
        begin = clock
        events = BitWriter()
        self._packet_header(events, instance, (begin, begin, 0, 0, sequence, instance))
        for _ in range(self._random.choice([0, 1, 5, 20])):
            step = self._random.choice(_STEPS)
            clock += step
            self._event(events, clock, step)
        used = events.position
        size = -(-used // 8) + self._random.choice([0, 1, 100])
        head = BitWriter()
        self._packet_header(head, instance, (begin, clock, used, size * 8, sequence, instance))
        head_size = head.position // 8
        body = events.content()[head_size:]
        return bytes(head.content() + body).ljust(size, b"\0"), used, clock

    def _packet_header(
        self, writer: BitWriter, instance: int, values: tuple[int, int, int, int, int, int]
    ) -> None:
        begin, end, used, size, sequence, cpu = values
        self._number(writer, 0xC1FC1FC1, 32)
        writer.bytes(UUID.bytes)
        self._number(writer, 7, 32)
        self._number(writer, instance, 64)
        for value in (begin, end, used, size, sequence):
            self._number(writer, value, 64)
        self._number(writer, 0, 32)
        self._number(writer, cpu, 32)

    def _number(self, writer: BitWriter, value: int, size: int) -> None:
        writer.integer(value, size, self._maker.align_of(size), self._style.big_endian)

    def _event(self, writer: BitWriter, clock: int, step: int) -> None:
        big = self._style.big_endian
        number = self._random.randrange(len(self._classes))
        id_bits, time_bits = (5, 27) if self._style.compact else (16, 32)
        align = 1 if self._style.compact else None
        extended = step >= 1 << time_bits or self._random.random() < 0.1
        # The structure of the header contains all options, so it is aligned for none of them.
        writer.align(self._header_align)
        shown = (1 << id_bits) - 1 if extended else number
        writer.integer(shown, id_bits, align or self._maker.align_of(id_bits), big)
        if extended:
            writer.align(max(self._maker.align_of(32), self._maker.align_of(64)))
            self._number(writer, number, 32)
            self._number(writer, clock, 64)
        else:
            low = clock & ((1 << time_bits) - 1)
            writer.integer(low, time_bits, align or self._maker.align_of(time_bits), big)
        write_all(self._context, writer)
        write_all(self._classes[number], writer)
