"""Hulls of two clocks, calculated by hand: moments in seconds, bounds in microseconds."""

from __future__ import annotations

from collections.abc import Sequence

import duckdb
import pytest

BEGIN_NS = 1_700_000_000_000_000_000
# What clock 2 is behind clock 1 at the first message, in microseconds.
BEHIND = 5_000_000
Point = tuple[float, float]


def add(
    con: duckdb.DuckDBPyConnection, sense: int, points: Sequence[Point], *, is_packet: bool = False
) -> None:
    """Add what messages say of clocks 2 and 1: to clock 2 (sense -1) or from it (1)."""
    con.executemany(
        "INSERT INTO bound VALUES (2, 1, ?, ?, ?, ?)",
        [
            (
                is_packet,
                sense,
                BEGIN_NS + round(moment * 1e9),
                round((bound - sense * BEHIND) * 1e3),
            )
            for moment, bound in points
        ],
    )


def corners(con: duckdb.DuckDBPyConnection, sense: int = -1) -> list[Point]:
    rows = con.execute(
        "SELECT moment, bound, base_ns, base_bound_ns FROM derive.clock_hull(1) WHERE sense = ? "
        "ORDER BY moment",
        [sense],
    ).fetchall()
    return [
        ((base + moment - BEGIN_NS) / 1e9, (bound - sense * base_bound) / 1e3 + sense * BEHIND)
        for moment, bound, base, base_bound in rows
    ]


def test_a_hull_lies_above_all_points(clocks: duckdb.DuckDBPyConnection) -> None:
    """In microseconds per second it goes by 30, 20, -15 and -55; the fifth point is below that."""
    points = [(0.0, -100.0), (2.0, -40.0), (4.0, 0.0), (6.0, -30.0), (8.0, -200.0), (10.0, -250.0)]
    add(clocks, -1, points)
    add(clocks, 1, points)
    expected = [point for point in points if point[0] != 8]
    assert corners(clocks) == expected
    assert corners(clocks, 1) == expected


def test_points_are_thinned_until_none_is_left_below(clocks: duckdb.DuckDBPyConnection) -> None:
    """A point above its neighbours may be below those that remain of them."""
    add(clocks, -1, [(0, 0), (1, -50), (2, -80), (3, -60), (4, -70), (5, -10), (6, 0)])
    assert corners(clocks) == [(0, 0), (6, 0)]
    add(clocks, -1, [(3, 1)])
    assert corners(clocks) == [(0, 0), (3, 1), (6, 0)]


def test_a_point_on_the_line_of_its_neighbours_is_no_corner(
    clocks: duckdb.DuckDBPyConnection,
) -> None:
    add(clocks, -1, [(0, 0), (1, 10), (2, 20), (3, 30)])
    assert corners(clocks) == [(0, 0), (3, 30)]


@pytest.mark.parametrize(("slope", "is_corner"), [(199, True), (200, False), (201, False)])
def test_no_hull_is_steeper_than_clocks_can_drift_apart(
    clocks: duckdb.DuckDBPyConnection, slope: int, *, is_corner: bool
) -> None:
    middle = [(2.0, 0.0), (8.0, 0.0)]
    first, last = (0.0, -2.0 * slope), (10.0, -2.0 * slope)
    add(clocks, -1, [first, *middle, last])
    assert corners(clocks) == ([first, *middle, last] if is_corner else middle)


def test_of_one_moment_only_the_highest_counts_and_once(clocks: duckdb.DuckDBPyConnection) -> None:
    add(clocks, -1, [(0, 5), (0, 4), (0, 5), (1, 7), (1, 7)])
    assert corners(clocks) == [(0, 5), (1, 7)]


def test_what_passed_is_counted_by_way_and_kind(clocks: duckdb.DuckDBPyConnection) -> None:
    add(clocks, -1, [(0, 1), (1, 2), (2, 1)])
    add(clocks, -1, [(3, -9)], is_packet=True)
    add(clocks, 1, [(0, -1), (1, -2)])
    add(clocks, 1, [(n, -n) for n in range(5)], is_packet=True)
    assert clocks.execute(
        "SELECT DISTINCT received_count, sent_count, received_packet_count, sent_packet_count, "
        "base_ns, base_bound_ns FROM derive.clock_hull(1)"
    ).fetchall() == [(3, 2, 1, 5, BEGIN_NS, (BEHIND + 2) * 1_000)]


def test_without_messages_received_those_sent_are_the_base(
    clocks: duckdb.DuckDBPyConnection,
) -> None:
    add(clocks, 1, [(0, -1), (1, 3)])
    assert corners(clocks, 1) == [(0, -1), (1, 3)]
    assert clocks.execute("SELECT DISTINCT base_bound_ns FROM derive.clock_hull(1)").fetchall() == [
        ((BEHIND - 3) * 1_000,)
    ]
