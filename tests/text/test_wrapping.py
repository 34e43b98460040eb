"""Where lines of text are broken."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from msgflow.text.wrapping import wrap


@pytest.mark.parametrize(
    ("text", "width", "lines"),
    [
        ("take to callback 247.270 µs", 24, ["take to callback", "247.270 µs"]),
        ("/imu/driver Timer(10 ms)", 20, ["/imu/driver", "Timer(10 ms)"]),
        ("known to ±0.232 ms at best", 14, ["known to", "±0.232 ms at", "best"]),
        ("callback 99 %, rest", 12, ["callback", "99 %, rest"]),
        ("the first 12 msgs", 13, ["the first 12", "msgs"]),
    ],
)
def test_a_number_stays_with_its_unit(text: str, width: int, lines: list[str]) -> None:
    assert wrap(text, width) == lines


@pytest.mark.parametrize(
    ("text", "width", "lines"),
    [
        ("Subscription(/camera/image)", 20, ["Subscription(", "/camera/image)"]),
        ("Subscription(/camera/image) 99 %", 20, ["Subscription(", "/camera/image) 99 %"]),
        ("Subscription(/camera/image)", 13, ["Subscription(", "/camera", "/image)"]),
        ("/perception/detector", 18, ["/perception", "/detector"]),
        ("/a/very_long_name_of_a_node", 10, ["/a", "/very_long", "_name_of_a", "_node"]),
    ],
)
def test_a_name_in_parentheses_stays_whole_where_it_can(
    text: str, width: int, lines: list[str]
) -> None:
    assert wrap(text, width) == lines


@given(st.text("ab/( )1s深", max_size=40), st.integers(2, 30))
def test_nothing_is_lost_and_no_line_is_too_wide(text: str, width: int) -> None:
    lines = wrap(text, width)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")
    assert max(map(cell_len, lines)) <= width
