"""The rules of the clock of stamps, each number of them from both sides."""

from __future__ import annotations

from collections.abc import Sequence

import duckdb
import pytest

STRETCH_NS = 500_000_000


def agreed(
    con: duckdb.DuckDBPyConnection, intervals: Sequence[tuple[int, int, int]]
) -> list[tuple[int, int]]:
    """(difference, votes) for intervals of (least, greatest, so many messages)."""
    con.execute(
        "CREATE OR REPLACE TABLE interval_ (clock_id BIGINT, stretch BIGINT, "
        "least_ns BIGINT, greatest_ns BIGINT)"
    )
    for least, greatest, count in intervals:
        con.execute(
            "INSERT INTO interval_ SELECT 1, 0, ?, ? FROM range(?)", [least, greatest, count]
        )
    return con.execute(
        "SELECT difference_ns, vote_count FROM derive.agreed_difference('interval_') ORDER BY 1"
    ).fetchall()


Region = tuple[int, int]
# (segment, difference, whether publications shortly after explain as much, whether no other does)
Followed = tuple[int, int, bool, bool]


def followed(
    con: duckdb.DuckDBPyConnection, stretches: Sequence[Sequence[Region]], clock: int = 1
) -> list[Followed]:
    """Return what is chosen in each stretch of half a second, of regions (difference, half)."""
    con.execute(
        "CREATE TABLE IF NOT EXISTS region (clock_id BIGINT, stretch BIGINT, least_ns BIGINT, "
        "greatest_ns BIGINT, difference_ns BIGINT, start_ns BIGINT, end_ns BIGINT)"
    )
    for stretch, regions in enumerate(stretches):
        start = stretch * STRETCH_NS
        for difference, half in regions:
            con.execute(
                "INSERT INTO region VALUES (?, ?, ?, ?, ?, ?, ?)",
                [
                    *(clock, stretch, difference - half, difference + half, difference),
                    *(start, start + STRETCH_NS),
                ],
            )
    return con.execute(
        "SELECT segment, difference_ns, is_soon, is_alone FROM derive.followed_difference('region')"
        " WHERE clock_id = ? ORDER BY stretch",
        [clock],
    ).fetchall()


def drift(con: duckdb.DuckDBPyConnection, differences: Sequence[int]) -> int:
    """Return the drift [ppb] of a segment with these differences, half a second apart."""
    con.execute(
        "CREATE OR REPLACE TABLE course (clock_id BIGINT, segment BIGINT, at_ns BIGINT, "
        "difference_ns BIGINT)"
    )
    for place, difference in enumerate(differences):
        con.execute("INSERT INTO course VALUES (1, 0, ?, ?)", [place * STRETCH_NS, difference])
    ((found,),) = con.execute("SELECT drift_ppb FROM derive.clock_drift('course')").fetchall()
    return int(found)


def test_the_middle_of_what_most_allow(rules: duckdb.DuckDBPyConnection) -> None:
    assert agreed(rules, [(0, 1_000, 5), (400, 2_000, 5)]) == [(700, 10)]


@pytest.mark.parametrize(("width", "below"), [(6_000, 3_000), (9_000, 4_000), (50_000, 4_000)])
def test_the_greatest_is_near_where_threads_go_on_late(
    rules: duckdb.DuckDBPyConnection, width: int, below: int
) -> None:
    assert agreed(rules, [(0, width, 10)]) == [(width - below, 10)]


@pytest.mark.parametrize(("votes", "is_rival"), [(18, True), (17, False)])
def test_nine_tenths_make_a_rival(
    rules: duckdb.DuckDBPyConnection, votes: int, *, is_rival: bool
) -> None:
    found = agreed(rules, [(0, 1_000, 20), (10_000, 11_000, votes)])
    assert found == [(500, 20), (10_500, votes)][: 1 + is_rival]


def test_a_drift_is_the_median_of_slopes(rules: duckdb.DuckDBPyConnection) -> None:
    """One wrong difference does not count."""
    assert drift(rules, [0]) == 0
    assert drift(rules, [0, 500, 1_000, 1_500, 2_000]) == 1_000
    assert drift(rules, [0, 500, 90_000, 1_500, 2_000, 2_500, 3_000]) == 1_000


def test_slopes_over_less_than_a_third_of_the_time_do_not_count(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """Of all neighbours but the last two, none shows that the clock moved."""
    assert drift(rules, [0, 0, 0, 0, 9_000]) == 2_250
    assert drift(rules, [0, 6_000, 0, 6_000, 0, 9_000, 9_000]) == 2_000


def test_the_nearest_difference_follows(rules: duckdb.DuckDBPyConnection) -> None:
    found = followed(rules, [[(0, 0), (900_000, 0)], [(1_000, 0), (800_000, 0)]])
    assert [(segment, difference) for segment, difference, *_ in found] == [(0, 0), (0, 1_000)]


@pytest.mark.parametrize("order", [1, -1])
def test_of_equally_near_differences_the_lesser_follows(
    rules: duckdb.DuckDBPyConnection, order: int
) -> None:
    found = followed(rules, [[(0, 0)], [(1_000, 0), (-1_000, 0)][::order]])
    assert [difference for _, difference, *_ in found] == [0, -1_000]


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("step", "segment"), [(190_000, 0), (210_000, 1)])
def test_what_a_drift_can_lead_to_is_no_step(
    rules: duckdb.DuckDBPyConnection, step: int, segment: int, side: int
) -> None:
    """From the begin of one stretch to the end of the next a second passes."""
    found = followed(rules, [[(0, 0)], [(side * step, 0)]])
    assert [segment for segment, *_ in found] == [0, segment]


@pytest.mark.parametrize(("step", "segment"), [(395_000, 0), (405_000, 1)])
def test_what_messages_allow_on_both_sides_is_no_step(
    rules: duckdb.DuckDBPyConnection, step: int, segment: int
) -> None:
    found = followed(rules, [[(0, 100_000)], [(step, 100_000)]])
    assert [segment for segment, *_ in found] == [0, segment]


@pytest.mark.parametrize(("apart", "is_near"), [(450_000, True), (550_000, False)])
def test_differences_within_a_burst_are_one(
    rules: duckdb.DuckDBPyConnection, apart: int, *, is_near: bool
) -> None:
    ((_, _, is_soon, is_alone),) = followed(rules, [[(0, 0), (-apart, 0)]])
    assert (is_soon, is_alone) == (is_near, is_near)


def test_each_clock_is_followed_by_itself(rules: duckdb.DuckDBPyConnection) -> None:
    steps = [[(0, 0)], [(10**9, 0)]]
    assert [segment for segment, *_ in followed(rules, steps, clock=2)] == [0, 1]
    assert [segment for segment, *_ in followed(rules, steps[:1], clock=1)] == [0]
