"""Metadata in its forms and languages, right and wrong."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from msgflow.errors import TraceError
from msgflow.trace.ctf import json_metadata, tsdl
from msgflow.trace.ctf.declarations import TraceClass
from msgflow.trace.ctf.field_types import (
    Array,
    Choice,
    Integer,
    Member,
    MetadataError,
    Real,
    Reference,
    Scope,
    Sequence,
    String,
    Structure,
    Type,
    VariableInteger,
    Variant,
)
from msgflow.trace.ctf.reader import read_metadata

BEGIN = "trace { major = 1; minor = 8; byte_order = le; };"


def payload(fields: str, before: str = "") -> dict[str, Type]:
    trace = tsdl.parse(f"{BEGIN} {before} event {{ fields := struct {{ {fields} }}; }};")
    return {m.name: m.type for m in trace.streams[0].events[0].payload.members}


class TestTypes:
    def test_integers(self) -> None:
        found = payload("""
            integer { size = 32; } a, _b;
            integer { size = 0x7; signed = true; } c;
            integer { size = 16; align = 010; byte_order = network; base = hex; } d;
        """)
        assert found == {
            "a": Integer(32, 8, False),
            "b": Integer(32, 8, False),
            "c": Integer(7, 1, False, signed=True),
            "d": Integer(16, 8, True, base=16),
        }

    def test_only_one_underscore_is_removed(self) -> None:
        before = "typealias integer { size = 8; } := u8;"
        assert list(payload("u8 __subs_length; u8 _subs; u8 _;", before)) == [
            "_subs_length",
            "subs",
            "",
        ]

    def test_names_of_many_words(self) -> None:
        before = """
            typealias integer { size = 64; } := unsigned long long;
            typedef integer { size = 8; } byte;
            typedef byte bytes[4];
        """
        assert payload("unsigned long long _a; const byte b; bytes c;", before) == {
            "a": Integer(64, 8, False),
            "b": Integer(8, 8, False),
            "c": Array(Integer(8, 8, False), 4),
        }

    def test_reals_and_texts(self) -> None:
        found = payload("""
            floating_point { exp_dig = 11; mant_dig = 53; align = 8; } a;
            floating_point { exp_dig = 8; mant_dig = 24; byte_order = be; } b;
            string c; string { encoding = ASCII; } d;
            integer { size = 8; encoding = UTF8; } e[17];
        """)
        assert found["a"] == Real(64, 8, False)
        assert found["b"] == Real(32, 1, True)
        assert found["c"] == found["d"] == String()
        assert isinstance(found["e"], Array)
        assert found["e"].is_text

    def test_arrays_and_sequences(self) -> None:
        before = "typealias integer { size = 8; } := u8;"
        found = payload("u8 _n; u8 a[_n]; u8 b[2][3]; u8 c[stream.event.context._m];", before)
        u8 = Integer(8, 8, False)
        assert found["a"] == Sequence(u8, Reference(None, ("n",)))
        assert found["b"] == Array(Array(u8, 3), 2)
        assert found["c"] == Sequence(u8, Reference(Scope.EVENT_CONTEXT, ("m",)))

    def test_structures_by_name(self) -> None:
        before = """
            typealias integer { size = 8; align = 8; } := u8;
            struct point { u8 x; struct { u8 _deep; } inner; } align(32);
        """
        found = payload("struct point a; struct point b[2];", before)
        u8 = Integer(8, 8, False)
        point = Structure((Member("x", u8), Member("inner", Structure((Member("deep", u8),)))), 32)
        assert found == {"a": point, "b": Array(point, 2)}
        assert point.align == 32

    def test_alignment_is_that_of_an_array_without_elements(self) -> None:
        assert Structure((Member("a", Array(Integer(64, 64, False), 0)),)).align == 64

    def test_enumerations_and_variants(self) -> None:
        before = "variant either { string one; integer { size = 8; } two; };"
        found = payload(
            """
            enum : integer { size = 8; signed = true; } { one, "two" = 5 ... 7, one = -3, } _tag;
            struct { variant either <_tag> _inner; } outer;
            """,
            before,
        )
        assert isinstance(found["tag"], Integer)
        assert found["tag"].labels == {"one": ((0, 0), (-3, -3)), "two": ((5, 7),)}
        variant = Variant(
            Reference(None, ("tag",)),
            (
                Choice("one", String(), ((0, 0), (-3, -3))),
                Choice("two", Integer(8, 8, False), ((5, 7),)),
            ),
        )
        assert found["outer"] == Structure((Member("inner", variant),))


class TestBlocks:
    def test_byte_order_holds_for_what_is_declared_before(self) -> None:
        text = "typealias integer { size = 16; } := u16; trace { byte_order = be; };"
        trace = tsdl.parse(text + 'event { name = "x"; fields := struct { u16 a; }; };')
        (member,) = trace.streams[0].events[0].payload.members
        assert member.type == Integer(16, 8, True)

    def test_environment_and_comments(self) -> None:
        trace = tsdl.parse(f"""{BEGIN} // a comment
            env {{ hostname = "a \\"b\\" \\x41\\n"; number = -5; text = "one" "two"; }};
            callsite {{ name = "x"; func = "f"; line = 3; }};
        """)
        assert trace.environment == {
            "hostname": 'a "b" A\n',
            "number": -5,
            "text": "onetwo",
        }

    def test_the_clock_is_the_one_that_is_mapped(self) -> None:
        trace = tsdl.parse(f"""{BEGIN}
            clock {{ name = "one"; freq = 1000; }};
            clock {{ name = "two"; offset_s = 1; offset = 20; uuid = "{"ab" * 16}"; }};
            stream {{ event.header := struct {{
                integer {{ size = 8; map = clock.two.value; }} timestamp; }}; }};
        """)
        clock = trace.streams[0].clock
        assert clock is not None
        assert (clock.name, clock.frequency, clock.to_ns(5)) == ("two", 10**9, 10**9 + 25)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "byte order is not declared"),
        ("trace { byte_order = middle; };", "unknown byte order 'middle'"),
        (BEGIN + " $", r"line 1: unexpected '\$'"),
        (BEGIN + "\n event { fields := struct { u8 a; }; };", "line 2: there is no type 'u8'"),
        (BEGIN + "event { fields := struct { integer { } a; }; };", "`size` is missing"),
        (
            BEGIN + "event { fields := struct { integer { size = 65; } a; }; };",
            "65 bits makes no sense",
        ),
        (BEGIN + "event { fields := struct { integer { size = 8; align = 3; } a; }; };", "3 bits"),
        (BEGIN + "event { fields := struct { string a", "the end"),
        (BEGIN + "event { stream_id = 4; };", "there is no stream 4"),
        (BEGIN + "event { id = 1; }; event { id = 1; };", "two events 1"),
        (BEGIN + "nonsense { };", "there is no block 'nonsense'"),
        (BEGIN + "clock { freq = 0; };", "0 Hz"),
        (BEGIN + "event { fields := struct { variant <a> { string b; } c; }; };", "selector 'a'"),
        (
            BEGIN
            + "struct s0 { string a; };"
            + "".join(f"struct s{n + 1} {{ struct s{n} a; struct s{n} b; }};" for n in range(40))
            + "event { fields := struct { struct s40 all; }; };",
            "more than 100000 fields",
        ),
        (BEGIN + "event { fields := struct { string a" + "[1]" * 5000 + "; }; };", "too deeply"),
        (BEGIN + "struct a {" * 5000, "the end|too deeply nested"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "metadata").write_text("/* CTF 1.8 */" + text)
    with pytest.raises(TraceError, match=message) as caught:
        read_metadata(tmp_path)
    assert str(tmp_path) in caught.value.message


@pytest.mark.parametrize(
    "text",
    [
        "\x1e{",
        "\x1e[]",
        '\x1e{"type": "preamble", "version": 3}',
        '\x1e{"type": "unheard-of"}',
        '\x1e{"type": "event-record-class"}',
        '\x1e{"type": "data-stream-class", "default-clock-class-id": "none"}',
        '\x1e{"type": "clock-class", "id": "a", "frequency": "fast"}',
        '\x1e{"type": "trace-class", "packet-header-field-class": {"type": "structure", '
        '"member-classes": [{"name": "a", "field-class": {"type": "fixed-length-boolean"}}]}}',
    ],
)
def test_what_is_wrong_in_json(text: str) -> None:
    with pytest.raises(MetadataError):
        json_metadata.parse(text)


@pytest.mark.parametrize("order", ["<", ">"])
def test_packets_in_both_byte_orders(tmp_path: Path, order: str) -> None:
    text = (BEGIN + 'env { hostname = "robot"; };').encode()
    content = b""
    for part in (text[:50], text[50:]):
        bits = (37 + len(part)) * 8
        head = struct.pack(f"{order}I16sIII5B", 0x75D11D57, b"", 0, bits, 4096 * 8, *range(5))
        content += (head + part).ljust(4096, b"\0")
    (tmp_path / "metadata").write_bytes(content)
    assert read_metadata(tmp_path).environment == {"hostname": "robot"}


def test_json_in_packets_whose_header_says_one_point_eight(tmp_path: Path) -> None:
    text = b'\x1e{"type": "preamble", "version": 2}\x1e{"type": "trace-class"}'
    bits = (37 + len(text)) * 8
    head = struct.pack("<I16sIII5B", 0x75D11D57, b"", 0, bits, bits, 0, 0, 0, 1, 8)
    (tmp_path / "metadata").write_bytes(head + text)
    assert isinstance(read_metadata(tmp_path), TraceClass)


def test_json_before_the_final_specification() -> None:
    """Integers with mappings had types of their own, and clocks an `offset`."""

    def integer(kind: str, more: str = "") -> str:
        return (
            f'{{"type": "{kind}", "length": 8, "byte-order": "little-endian", "alignment": 8, '
            f'"mappings": {{"a": [[0, 1], [5, 5]]}}{more}}}'
        )

    members = ", ".join(
        f'{{"name": "{kind}", "field-class": {integer(kind)}}}'
        for kind in (
            "fixed-length-unsigned-enumeration",
            "fixed-length-signed-enumeration",
            "variable-length-unsigned-enumeration",
            "variable-length-signed-enumeration",
        )
    )
    trace = json_metadata.parse(
        '\x1e{"type": "preamble", "version": 2}'
        '\x1e{"type": "clock-class", "name": "c", "frequency": 1000000000, '
        '"offset": {"seconds": 3, "cycles": 4}}'
        '\x1e{"type": "data-stream-class", "id": 0, "default-clock-class-name": "c"}'
        '\x1e{"type": "event-record-class", "payload-field-class": {"type": "structure", '
        f'"member-classes": [{members}]}}}}'
    )
    stream = trace.streams[0]
    labels = {"a": ((0, 1), (5, 5))}
    assert [member.type for member in stream.events[0].payload.members] == [
        Integer(8, 8, False, labels=labels),
        Integer(8, 8, False, signed=True, labels=labels),
        VariableInteger(False, labels),
        VariableInteger(True, labels),
    ]
    assert stream.clock is not None
    assert stream.clock.to_ns(1) == 3_000_000_005
