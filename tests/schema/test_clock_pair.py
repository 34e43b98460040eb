"""The line between the hulls of two clocks and its bound, calculated by hand.

Moments are seconds, corrections microseconds beyond `BEHIND`, drifts microseconds per second.
"""

from __future__ import annotations

from collections.abc import Mapping

import duckdb
import pytest

BEGIN_NS = 1_700_000_000_000_000_000
# What clock 2 is behind clock 1, in microseconds.
BEHIND = 5_000_000


def exchange(
    con: duckdb.DuckDBPyConnection, least: Mapping[float, float], most: Mapping[float, float]
) -> None:
    """Add what has to be added to the times of clock 2 at least, and at most, at some moments."""
    rows = [
        (sense, BEGIN_NS + round(moment * 1e9), -sense * round((BEHIND + correction) * 1e3))
        for sense, corrections in ((-1, least), (1, most))
        for moment, correction in corrections.items()
    ]
    con.executemany("INSERT INTO bound (sense, at_ns, bound_ns) VALUES (?, ?, ?)", rows)


def record(con: duckdb.DuckDBPyConnection, *traces: tuple[int, int, int]) -> None:
    """Add traces: clock, and from when to when, as it showed it."""
    con.executemany(
        "INSERT INTO store.trace VALUES (?, ?, ?)",
        [(clock, *(BEGIN_NS + moment * 10**9 for moment in span)) for clock, *span in traces],
    )


def line(con: duckdb.DuckDBPyConnection) -> tuple[float, float, float, float, float | None]:
    """Moment of reference, offset, its bound, drift and its bound."""
    ((at, offset, uncertainty, drift, drift_uncertainty),) = con.execute(
        "SELECT reference_ns, offset_ns, uncertainty_ns, drift_ppb, drift_uncertainty_ppb "
        "FROM derive.clock_pair(1)"
    ).fetchall()
    return (
        (at - BEGIN_NS) / 1e9,
        offset / 1e3 - BEHIND,
        uncertainty / 1e3,
        drift / 1e3,
        None if drift_uncertainty is None else drift_uncertainty / 1e3,
    )


def bounds(con: duckdb.DuckDBPyConnection) -> dict[float, float]:
    """The bound of the error at the moments at which it changes its growth."""
    rows = con.execute(
        "SELECT b.at_ns, b.uncertainty_ns FROM derive.clock_pair(1) AS p, unnest(p.bounds) AS u (b)"
    ).fetchall()
    return {(at - BEGIN_NS) / 1e9: uncertainty / 1e3 for at, uncertainty in rows}


def test_hulls_at_a_constant_distance(clocks: duckdb.DuckDBPyConnection) -> None:
    """It may be less by all of that at the one end, and more at the other."""
    exchange(clocks, {0: -100, 10: -100}, {0: 100, 10: 100})
    assert line(clocks) == (0, 0, 100, 0, 20)
    assert bounds(clocks) == {0: 100, 10: 100}


def test_bounds_as_long_as_one_of_both_was_recorded(clocks: duckdb.DuckDBPyConnection) -> None:
    """Each grows with the drift that is possible, 20."""
    exchange(clocks, {0: -100, 10: -100}, {0: 100, 10: 100})
    # Clock 1 shows five seconds more.
    record(clocks, (2, -1, 11), (2, -5, 4), (1, 2, 25))
    assert bounds(clocks) == pytest.approx({-5: 200, 0: 100, 10: 100, 20: 300}, abs=0.002)


def test_a_line_through_the_narrowest_place(clocks: duckdb.DuckDBPyConnection) -> None:
    """Parallel to the longest edge; no possible line is as steep as the other edges."""
    exchange(clocks, {0: -300, 5: -50, 10: -300}, {0: 100, 10: 100})
    assert line(clocks) == (5, 25, 75, 0, 30)
    assert bounds(clocks) == {0: 225, 5: 75, 10: 225}


def test_the_same_turned_round(clocks: duckdb.DuckDBPyConnection) -> None:
    exchange(clocks, {0: -100, 10: -100}, {0: 300, 5: 50, 10: 300})
    assert line(clocks) == (5, -25, 75, 0, 30)
    assert bounds(clocks) == {0: 225, 5: 75, 10: 225}


def test_the_bound_turns_where_the_other_side_becomes_the_farther(
    clocks: duckdb.DuckDBPyConnection,
) -> None:
    """From 0 on a line may lie below by 20 per second; above by 60 per second, from 2 on."""
    exchange(clocks, {8: -100, 16: -260}, {0: 100, 10: 100, 16: 460})
    assert line(clocks) == (8, 0, 100, 0, 70)
    assert bounds(clocks) == {0: 660, 8: 100, 10: 140, 11: 160, 16: 460}
    record(clocks, (2, -2, 20))
    assert bounds(clocks) == pytest.approx(
        {-2: 800, 0: 660, 8: 100, 10: 140, 11: 160, 16: 460, 20: 740}, abs=0.002
    )


def test_an_edge_that_is_possible_bounds_the_lines(clocks: duckdb.DuckDBPyConnection) -> None:
    """The first, 25 steep; lines may be from -20 to 37.5 steep."""
    exchange(clocks, {0: -200, 4: -100, 14: -100}, {4: 100, 8: 100})
    assert line(clocks) == (4, 0, 100, 0, 37.5)
    assert bounds(clocks) == {0: 200, 4: 100, 8: 100, 14: 325}


def test_of_equally_narrow_places_the_first(clocks: duckdb.DuckDBPyConnection) -> None:
    exchange(clocks, {0: -100, 10: -100}, {0: 100, 5: 100, 10: 110})
    assert line(clocks)[:3] == (0, 0, 100)


def test_what_lies_before_the_first_message_is_no_edge(clocks: duckdb.DuckDBPyConnection) -> None:
    """Ten seconds are longer than any edge."""
    exchange(clocks, {10: -100, 12: -100}, {0: 100, 7: 100, 12: 130})
    assert line(clocks)[:4] == (10, 9, 109, 0)


def test_without_an_edge_a_drift_is_in_the_middle(clocks: duckdb.DuckDBPyConnection) -> None:
    """Of what is possible from the first message to the second, one each way, a second later."""
    exchange(clocks, {0: -100}, {1: 100})
    assert line(clocks) == (0, 100, 200, -100, 300)
    clocks.execute("TRUNCATE bound")
    exchange(clocks, {1: -100}, {0: 100})
    assert line(clocks) == (0, -100, 200, 100, 300)


def test_messages_one_way_and_then_the_other(clocks: duckdb.DuckDBPyConnection) -> None:
    """Clocks drift apart by up to 200 in the second in between."""
    exchange(clocks, {0: -700, 4: -100}, {5: 100})
    # At either of its ends.
    assert line(clocks)[2:] == (200, 0, 200)


def test_bounds_are_rounded_up(clocks: duckdb.DuckDBPyConnection) -> None:
    """The middle of 201 ns is one of two whole numbers; 200 ns in three seconds are 66.7e-9."""
    exchange(clocks, {0: -0.100}, {0: 0.101})
    assert line(clocks)[2] == 0.101
    clocks.execute("TRUNCATE bound")
    exchange(clocks, {0: -0.1, 3: -0.1}, {0: 0.1, 3: 0.1})
    record(clocks, (2, 0, 4))
    assert line(clocks)[4] == 0.067
    assert bounds(clocks) == {0: 0.1, 3: 0.1, 4: 0.167}


def test_a_drift_is_that_of_the_longest_edge(clocks: duckdb.DuckDBPyConnection) -> None:
    exchange(clocks, {0: 0, 6: 60, 10: 80}, {0: 100, 4: 120, 10: 180})
    assert line(clocks)[3] == 10


def test_a_drift_that_is_not_possible_there_is_the_nearest_one(
    clocks: duckdb.DuckDBPyConnection,
) -> None:
    """The longest edge has 20, and would cut the other hull four seconds later, or before."""
    exchange(clocks, {0: -400, 20: 0}, {18: 40, 20: 20, 24: 20})
    assert line(clocks) == (20, 10, 10, 2.5, 22.5)
    assert bounds(clocks) == pytest.approx({0: 440, 18: 35, 20: 10, 24: 100}, abs=0.002)
    clocks.execute("TRUNCATE bound")
    exchange(clocks, {4: 0, 24: -400}, {0: 20, 4: 20, 6: 40})
    assert line(clocks)[:4] == (4, 10, 10, -2.5)


@pytest.mark.parametrize(("sent", "received"), [(190, 190), (210, 200)])
def test_no_drift_is_faster_than_clocks_are(
    clocks: duckdb.DuckDBPyConnection, sent: int, received: int
) -> None:
    exchange(clocks, {0: -1, 10: sent * 10 - 1}, {0: 1, 10: sent * 10 + 1})
    assert line(clocks)[3] == (received if sent < 200 else 0)


@pytest.mark.parametrize(("distance", "is_even"), [(0, True), (-1, False)])
def test_a_line_is_possible_where_the_hulls_do_not_cross(
    clocks: duckdb.DuckDBPyConnection, distance: float, *, is_even: bool
) -> None:
    exchange(clocks, {0: 0}, {0: distance})
    (found,) = clocks.execute("SELECT is_even FROM derive.clock_pair(1)").fetchall()
    assert found == (is_even,)
    assert (line(clocks)[4] is None) is not is_even


@pytest.mark.parametrize(("slow_ns", "missed"), [(1, 1.0), (2, 9.0)])
def test_without_a_possible_line_the_fastest_of_each_stretch_counts(
    clocks: duckdb.DuckDBPyConnection, slow_ns: int, missed: float
) -> None:
    """Stretches are a 256th of the time: here 2 ns; the first has a fast message."""
    exchange(clocks, {0: 1, slow_ns / 1e9: -9, 511e-9: 1}, {0: -1, 511e-9: -1})
    assert line(clocks) == (0, 0, missed, 0, None)
    assert bounds(clocks) == {0: missed, 511e-9: missed}


def test_without_a_possible_line_the_one_that_misses_least_is_taken(
    clocks: duckdb.DuckDBPyConnection,
) -> None:
    """That is parallel to the edges. One message between takes 9 us more."""
    exchange(clocks, {0: 1, 10: 101}, {0: -1, 10: 99})
    assert line(clocks) == (0, 0, 1, 10, None)
    exchange(clocks, {5.00005: 41}, {})
    assert line(clocks) == (0, 0, 9.001, 10, None)


def test_an_edge_of_either_hull_tells_the_drift_of_a_line_that_misses(
    clocks: duckdb.DuckDBPyConnection,
) -> None:
    exchange(clocks, {0: 1}, {0: -1, 10: 99})
    assert line(clocks)[3] == 10


def test_one_way_alone_gives_nothing(clocks: duckdb.DuckDBPyConnection) -> None:
    exchange(clocks, {0: 0, 1: 0}, {})
    assert clocks.execute(
        "SELECT received_count, sent_count, offset_ns, uncertainty_ns, bounds "
        "FROM derive.clock_pair(1)"
    ).fetchall() == [(2, 0, None, None, None)]
