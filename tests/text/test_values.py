from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from msgflow.text.values import column_title, format_cell, format_duration, short_symbol


@pytest.mark.parametrize(
    ("duration_ns", "text"),
    [
        (0, "0 ns"),
        (999, "999 ns"),
        (1_000, "1.000 µs"),
        (562_411, "562.411 µs"),
        (999_999, "999.999 µs"),
        (1_000_000, "1.000 ms"),
        (45_601_667, "45.602 ms"),
        (999_999_600, "1.000 s"),
        (1_250_000_000, "1.250 s"),
        (3_600_000_000_000, "3600.000 s"),
        (-131_601, "-131.601 µs"),
        (131_600.7, "131.601 µs"),
    ],
)
def test_durations(duration_ns: float, text: str) -> None:
    assert format_duration(duration_ns) == text


@given(st.integers(-(10**15), 10**15))
def test_a_printed_duration_is_right_to_the_last_digit(duration_ns: int) -> None:
    number, unit = format_duration(duration_ns).split()
    factor = {"ns": 1, "µs": 1_000, "ms": 1_000_000, "s": 1_000_000_000}[unit]
    resolution = 1 if unit == "ns" else factor / 1_000
    assert abs(float(number) * factor - duration_ns) <= resolution / 2 + abs(duration_ns) * 1e-15


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (None, "ns", "-"),
        ("", None, ""),
        (True, None, "yes"),
        (False, None, "no"),
        (1234567, None, "1234567"),
        (1_700_000_000_000_000_001, "epoch ns", "2023-11-14T22:13:20.000000001Z"),
        (562_411, "ns", "562.411 µs"),
        (199.98765, "Hz", "199.988"),
        (0.0, None, "0.000"),
        (0.0000123456, None, "1.23e-05"),
        (0.0000123456, "share", "0.000"),
        (0.0005, "share", "0.001"),
        (0.0, "share", "0.000"),
        (0.84567, "share", "0.846"),
        (b"\x01\xff", None, "01ff"),
        ([1_000, 2_000_000], "ns", "1.000 µs, 2.000 ms"),
        ("two\nlines\x1b[31m", None, r"two\nlines\x1b[31m"),
        ("größe →", None, "größe →"),
        (float("nan"), None, "-"),
    ],
)
def test_cells(value: object, unit: str | None, text: str) -> None:
    assert format_cell(value, unit) == text


def test_handles_are_hexadecimal() -> None:
    assert format_cell(2**64 - 1, is_handle=True) == "0xffffffffffffffff"


def test_a_map_has_its_keys() -> None:
    assert format_cell([("robot", "r1"), ("site", None)]) == "robot=r1, site=-"
    assert format_cell([[1, 2], [3]]) == "1, 2, 3"


def test_the_suffix_goes_where_the_unit_stands_in_the_cells() -> None:
    assert column_title("median_ns", "ns", ("median_ns",)) == "median"
    assert column_title("start_ns", "epoch ns", ("start_ns",)) == "start"
    assert column_title("median_ns", None, ("median_ns",)) == "median_ns"
    assert column_title("delay_ns", "ns", ("delay", "delay_ns")) == "delay_ns"


def test_no_terminal_obeys_a_title() -> None:
    assert column_title("a\tb", None, ("a\tb",)) == "a\\tb"
    assert column_title("\x1b[31m_ns", "ns", ("\x1b[31m_ns",)) == "\\x1b[31m"


@pytest.mark.parametrize(
    ("symbol", "shown"),
    [
        ("Camera::tick", "Camera::tick"),
        ("void Foo::bar(std::shared_ptr<int>) const", "void Foo::bar const"),
        ("std::_Bind<void (SourceNode::*(SourceNode*))()>", "SourceNode::*"),
        (
            "std::_Bind<void (robot::Base::*(robot::Base*, std::_Placeholder<1>))(int)>",
            "robot::Base::*",
        ),
        ("Sink::Sink(std::vector<char>)::{lambda(A<B>)#1}", "Sink::Sink::{lambda#1}"),
        ("(anonymous)", "(anonymous)"),
        (">odd)", ">odd)"),
        ("", ""),
    ],
)
def test_symbols_without_arguments(symbol: str, shown: str) -> None:
    assert short_symbol(symbol) == shown
