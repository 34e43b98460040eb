from __future__ import annotations

import pytest

from msgflow.sql.value import Value, parse_literal, parse_text


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("NULL", None),
        ("true", True),
        ("FALSE", False),
        ("-3", -3),
        ("9223372036854775807", 2**63 - 1),
        ("0.25", 0.25),
        ("1e-3", 0.001),
        ("'a''b'", "a'b"),
        ("''", ""),
        ("[]", []),
        ("[1, 2]", [1, 2]),
    ],
)
def test_literals(text: str, value: Value) -> None:
    parsed = parse_literal(text)
    assert parsed == value
    assert type(parsed) is type(value)


@pytest.mark.parametrize("text", ["", "word", "'open", "now()", "1 + 1"])
def test_what_is_no_literal_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not NULL"):
        parse_literal(text)


@pytest.mark.parametrize(
    ("text", "type_name", "value"),
    [
        ("/topic", "VARCHAR", "/topic"),
        ("12", "VARCHAR", "12"),
        ("", "VARCHAR", ""),
        ("12", "BIGINT", 12),
        ("0xff", "UBIGINT", 255),
        ("1", "DOUBLE", 1.0),
        ("0.5,0.9", "DOUBLE[]", [0.5, 0.9]),
        ("a, b", "VARCHAR[]", ["a", "b"]),
        ("yes", "BOOLEAN", True),
        ("Off", "BOOLEAN", False),
    ],
)
def test_text_is_read_as_the_declared_type(text: str, type_name: str, value: Value) -> None:
    parsed = parse_text(text, type_name)
    assert parsed == value
    assert type(parsed) is type(value)


@pytest.mark.parametrize(
    ("text", "type_name"), [("1.5", "BIGINT"), ("x", "DOUBLE"), ("maybe", "BOOLEAN")]
)
def test_text_of_another_type_is_refused(text: str, type_name: str) -> None:
    with pytest.raises(ValueError, match=r".+"):
        parse_text(text, type_name)
