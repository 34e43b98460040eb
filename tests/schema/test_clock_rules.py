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
        "SELECT difference_ns, vote_count FROM derive.agreed_difference('interval_', 0.9) "
        "ORDER BY 1"
    ).fetchall()


# A difference and half of its range; true if only half of the messages agree with it.
Region = tuple[int, int] | tuple[int, int, bool]
# (segment, difference, whether publications shortly after explain as much, whether no other does)
Followed = tuple[int, int, bool, bool]


def followed(
    con: duckdb.DuckDBPyConnection,
    stretches: Sequence[Sequence[Region]],
    clock: int = 1,
    *,
    is_taken_here: bool = True,
) -> list[Followed]:
    """Return what is chosen in each stretch of half a second, of regions (difference, half)."""
    con.execute(
        "CREATE TABLE IF NOT EXISTS region (clock_id BIGINT, stretch BIGINT, least_ns BIGINT, "
        "greatest_ns BIGINT, difference_ns BIGINT, start_ns BIGINT, end_ns BIGINT, "
        "is_taken_here BOOLEAN, is_rival BOOLEAN)"
    )
    for stretch, regions in enumerate(stretches):
        start = stretch * STRETCH_NS
        for difference, half, *is_few in regions:
            con.execute(
                "INSERT INTO region VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [
                    *(clock, stretch, difference - half, difference + half, difference),
                    *(start, start + STRETCH_NS, is_taken_here, not is_few),
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
@pytest.mark.parametrize(("step", "is_set"), [(190_000, False), (210_000, True)])
def test_what_a_drift_can_lead_to_is_no_step(
    rules: duckdb.DuckDBPyConnection, step: int, side: int, *, is_set: bool
) -> None:
    """From the begin of one stretch to the end of the next a second passes."""
    found = followed(rules, [[(0, 0)], [(side * step, 0)]])
    assert [segment > 0 for segment, *_ in found] == [False, is_set]


@pytest.mark.parametrize(("step", "is_set"), [(395_000, False), (405_000, True)])
def test_what_messages_allow_on_both_sides_is_no_step(
    rules: duckdb.DuckDBPyConnection, step: int, *, is_set: bool
) -> None:
    found = followed(rules, [[(0, 100_000)], [(step, 100_000)]])
    assert [segment > 0 for segment, *_ in found] == [False, is_set]


@pytest.mark.parametrize(("apart", "is_near"), [(450_000, True), (550_000, False)])
def test_differences_within_a_burst_are_one(
    rules: duckdb.DuckDBPyConnection, apart: int, *, is_near: bool
) -> None:
    ((_, _, is_soon, is_alone),) = followed(rules, [[(0, 0), (-apart, 0)]])
    assert (is_soon, is_alone) == (is_near, is_near)


def test_each_clock_is_followed_by_itself(rules: duckdb.DuckDBPyConnection) -> None:
    steps = [[(0, 0)], [(10**9, 0)]]
    assert [segment > 0 for segment, *_ in followed(rules, steps, clock=2)] == [False, True]
    assert [segment for segment, *_ in followed(rules, steps[:1], clock=1)] == [0]


FAR = 60_000_000
START = 7_000_000
# Nine tenths of a stretch's messages agree with a greater difference, half with that of before.
HALF: list[Region] = [(0, 0, True), (FAR, 0)]


@pytest.mark.parametrize(("lasting", "expected"), [(3, (2, START)), (2, (6, 2 * FAR))])
def test_behind_lost_publications_the_line_that_lasted_is_right_again(
    rules: duckdb.DuckDBPyConnection, lasting: int, expected: tuple[int, int]
) -> None:
    """The clock is set behind the first stretch."""
    lost = [[(FAR, 0)], [(START, 0), (FAR, 0)], [(2 * FAR, 0)], [(START, 0), (2 * FAR, 0)]]
    found = followed(rules, [[(0, 0)], *[[(START, 0)]] * lasting, *lost])
    assert found[-1][:2] == expected


def test_a_line_that_is_right_is_not_left_for_one_of_before(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """A drift could have moved that to here, too, after some seconds."""
    step = 400_000
    found = followed(rules, [[(0, 0)], *[[(step, 0)]] * 6, [(0, 0), (step, 0)]])
    assert [one[:2] for one in found[1:]] == [(2, step)] * 7


@pytest.mark.parametrize(("is_taken_here", "chosen"), [(True, -FAR), (False, 20_000_000)])
def test_a_clock_was_set_to_the_least_difference_if_messages_were_taken_on_it(
    rules: duckdb.DuckDBPyConnection, chosen: int, *, is_taken_here: bool
) -> None:
    regions = [(-FAR, 0), (20_000_000, 0)]
    found = followed(rules, [[(0, 0)], regions], is_taken_here=is_taken_here)
    assert found[-1][1] == chosen


@pytest.mark.parametrize(("is_taken_here", "chosen"), [(True, FAR), (False, 0)])
def test_a_former_line_is_not_right_if_messages_taken_here_could_be_of_later_publications(
    rules: duckdb.DuckDBPyConnection, chosen: int, *, is_taken_here: bool
) -> None:
    regions = [(0, 0), (-10_000_000, 0), (FAR, 0)]
    found = followed(rules, [[(0, 0)], [(FAR, 0)], regions], is_taken_here=is_taken_here)
    assert found[-1][1] == chosen


@pytest.mark.parametrize("is_taken_here", [True, False])
@pytest.mark.parametrize("lost", [1, 3, 4])
def test_three_stretches_in_which_half_agree_say_nothing(
    rules: duckdb.DuckDBPyConnection, lost: int, *, is_taken_here: bool
) -> None:
    found = followed(rules, [[(0, 0)], *[HALF] * lost, [(0, 0)]], is_taken_here=is_taken_here)
    here = (0, 0)
    assert [one[:2] for one in found] == [here, *[(5, FAR)] * (lost > 3), here]


def test_half_of_the_messages_say_nothing_if_the_others_are_of_later_publications(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    found = followed(rules, [[(0, 0)], [(0, 0, True), (-FAR, 0)]])
    assert [difference for _, difference, *_ in found] == [0, -FAR]


def test_half_of_the_messages_make_no_line(rules: duckdb.DuckDBPyConnection) -> None:
    found = followed(rules, [[(FAR, 0), (START, 0, True)]])
    assert [difference for _, difference, *_ in found] == [FAR]
