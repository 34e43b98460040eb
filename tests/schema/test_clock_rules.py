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


Region = tuple[int, int, int]


def followed(
    con: duckdb.DuckDBPyConnection,
    stretches: Sequence[Sequence[Region]],
    *,
    is_here: bool = True,
) -> list[tuple[int, int, int]]:
    """(difference, votes, segment) per stretch, of regions (difference, half width, votes)."""
    con.execute(
        "CREATE OR REPLACE TABLE region (clock_id BIGINT, stretch BIGINT, least_ns BIGINT, "
        "greatest_ns BIGINT, difference_ns BIGINT, vote_count BIGINT, most_count BIGINT, "
        "is_taken_here BOOLEAN, stretch_ns BIGINT)"
    )
    for stretch, regions in enumerate(stretches):
        most = max(votes for _, _, votes in regions)
        for difference, half, votes in regions:
            con.execute(
                "INSERT INTO region VALUES (1, ?, ?, ?, ?, ?, ?, ?, ?)",
                [
                    stretch,
                    difference - half,
                    difference + half,
                    difference,
                    votes,
                    most,
                    is_here,
                    STRETCH_NS,
                ],
            )
    return con.execute(
        "SELECT difference_ns, message_count, segment FROM derive.followed_difference('region') "
        "ORDER BY stretch"
    ).fetchall()


def drift(con: duckdb.DuckDBPyConnection, offsets: Sequence[int]) -> list[float]:
    """Drift of each stretch [ppb], of the differences in it."""
    con.execute(
        "CREATE OR REPLACE TABLE course (clock_id BIGINT, place BIGINT, stretch BIGINT, "
        "at_ns BIGINT, offset_ns BIGINT)"
    )
    for stretch, offset in enumerate(offsets):
        con.execute(
            "INSERT INTO course VALUES (1, 1, ?, ?, ?)", [stretch, stretch * STRETCH_NS, offset]
        )
    rows = con.execute("SELECT drift_ppb FROM derive.clock_drift('course') ORDER BY stretch")
    return [value for (value,) in rows.fetchall()]


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


@pytest.mark.parametrize(("ppm", "is_possible"), [(190, True), (210, False)])
def test_no_clock_drifts_faster(
    rules: duckdb.DuckDBPyConnection, ppm: int, *, is_possible: bool
) -> None:
    expected = ppm * 1_000 if is_possible else 0
    assert drift(rules, [n * ppm * 500 for n in range(3)]) == [expected] * 3


def test_a_drift_is_that_of_five_stretches_around(rules: duckdb.DuckDBPyConnection) -> None:
    """It changes after the twentieth stretch; the fifteenth has the old one all around."""
    offsets = [0] * 21 + [n * 25_000 for n in range(1, 20)]
    found = drift(rules, offsets)
    assert found[15] == 0
    assert found[19] > 0
    assert 0 < found[20] < 50_000
    assert found[25] == 50_000


def test_few_messages_keep_a_clock_that_is_that_of_the_trace(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    assert followed(rules, [[(0, 500, 3)]]) == [(0, 3, 0)]
    assert followed(rules, [[(5_000, 500, 7)]]) == []


@pytest.mark.parametrize(("votes", "is_known"), [(8, True), (7, False)])
def test_a_jump_takes_a_quorum(
    rules: duckdb.DuckDBPyConnection, votes: int, *, is_known: bool
) -> None:
    jump = [(3_000_000, 500, votes)]
    expected = [(3_000_000, votes, 1)] if is_known else []
    assert followed(rules, [jump] * 3) == expected * 3


def test_a_jump_takes_three_stretches(rules: duckdb.DuckDBPyConnection) -> None:
    old, new, odd = [(0, 500, 20)], [(3_000_000, 500, 20)], [(9_000_000, 500, 20)]
    assert followed(rules, [old, new, odd, old])[1][1:] == (0, 0)
    assert followed(rules, [old, new, new, odd])[1][1:] == (0, 0)
    assert followed(rules, [old, new, new, new])[1] == (3_000_000, 20, 1)


def test_a_jump_at_the_end_is_not_confirmed(rules: duckdb.DuckDBPyConnection) -> None:
    old, new = [(0, 500, 20)], [(3_000_000, 500, 20)]
    assert followed(rules, [old, new]) == [(0, 20, 0), (0, 0, 0)]
    assert followed(rules, [old, new, new]) == [(0, 20, 0), (0, 0, 0), (0, 0, 0)]


@pytest.mark.parametrize("before", [0, 1, 2])
def test_no_clock_begins_in_the_last_two_stretches(
    rules: duckdb.DuckDBPyConnection, before: int
) -> None:
    """But where there are no others."""
    few, clock = [(5_000, 500, 7)], [(3_000_000, 500, 20)]
    expected = [(3_000_000, 20, 1)] * 2 if before == 0 else []
    found = followed(rules, [few] * before + [clock] * 2)
    assert [row for row in found if row[1]] == expected


def test_a_clock_of_one_stretch_may_begin_anywhere(rules: duckdb.DuckDBPyConnection) -> None:
    assert followed(rules, [[(3_000_000, 500, 20)]]) == [(3_000_000, 20, 1)]


def test_each_clock_is_followed_by_itself(rules: duckdb.DuckDBPyConnection) -> None:
    """One has jumped; what the messages of the other agree with changes all the time."""
    followed(rules, [[(3_000_000, 500, 20)]] * 3)
    rules.execute(
        "INSERT INTO region SELECT 2, stretch, least_ns + change, greatest_ns + change, "
        "difference_ns + change, vote_count, most_count, is_taken_here, stretch_ns "
        "FROM (SELECT *, 4000000 * stretch AS change FROM region)"
    )
    rows = rules.execute(
        "SELECT clock_id, difference_ns, segment FROM derive.followed_difference('region') "
        "ORDER BY clock_id, stretch"
    ).fetchall()
    assert rows == [(1, 3_000_000, 1)] * 3 + [(2, 0, 0)] * 3


@pytest.mark.parametrize(("away", "segment"), [(390_000, 0), (410_000, 1)])
def test_while_nothing_is_known_a_clock_drifts(
    rules: duckdb.DuckDBPyConnection, away: int, segment: int
) -> None:
    few = [(5_000_000, 0, 7)]
    found = followed(rules, [[(0, 0, 20)], few, few, *[[(away, 0, 20)]] * 3])
    assert found[1] == (away, 20, segment)


def test_a_clock_drifts_from_where_it_jumped_to(rules: duckdb.DuckDBPyConnection) -> None:
    """Since then: in five stretches it cannot get to what most messages agree with."""
    jump, few = 3_000_000, [(5_000_000, 0, 7)]
    later = [(jump - 480_000, 0, 19), (jump + 550_000, 0, 20)]
    found = followed(rules, [[(0, 0, 20)], [(jump, 0, 20)], few, few, few, later, later[:1]])
    assert found[1:] == [(jump, 20, 1), (jump - 480_000, 19, 1), (jump - 480_000, 19, 1)]


@pytest.mark.parametrize("order", [1, -1])
def test_of_equal_differences_a_jump_is_to_the_greatest(
    rules: duckdb.DuckDBPyConnection, order: int
) -> None:
    """With any other, all messages would have been stamped later than they may have been."""
    jump = [(3_000_000, 500, 20), (3_004_000, 500, 20), (3_002_000, 500, 20)][::order]
    assert followed(rules, [jump] * 3) == [(3_004_000, 20, 1)] * 3


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("away", "is_close"), [(99_000, True), (101_000, False)])
def test_a_pair_is_close_if_a_drift_may_bring_it_there(
    rules: duckdb.DuckDBPyConnection, away: int, side: int, *, is_close: bool
) -> None:
    """200 ppm of half a second are 100 µs."""
    rules.execute(
        "CREATE TABLE course AS SELECT 1 AS clock_id, 0 AS stretch, ? AS stretch_ns, "
        "7000000 AS offset_ns",
        [STRETCH_NS],
    )
    near = 7_000_000 + side * away
    rules.execute(
        "CREATE TABLE pair AS SELECT 1 AS clock_id, 0 AS stretch, 0 AS written_ns, "
        "least(n, f) AS least_ns, greatest(n, f) AS greatest_ns FROM (SELECT ? AS n, ? AS f)",
        [near, near + side * 1_000],
    )
    found = rules.execute("SELECT count(*) FROM derive.close_pair('pair', 'course')").fetchall()
    assert found == [(is_close,)]


def sharp(
    con: duckdb.DuckDBPyConnection,
    offsets: Sequence[int],
    intervals: Sequence[tuple[int, int, int, int]],
    reach: int,
) -> list[tuple[int, int]]:
    """(difference, drift) by stretch, of intervals (stretch, least, greatest, so many)."""
    drift(con, offsets)
    con.execute(
        "CREATE OR REPLACE TABLE pair (clock_id BIGINT, stretch BIGINT, written_ns BIGINT, "
        "least_ns BIGINT, greatest_ns BIGINT)"
    )
    for stretch, least, greatest, count in intervals:
        con.execute(
            "INSERT INTO pair SELECT 1, ?, ?, ?, ? FROM range(?)",
            [stretch, stretch * STRETCH_NS, least, greatest, count],
        )
    rows = con.execute(
        "SELECT offset_ns, drift_ppb::BIGINT FROM derive.sharp_difference('pair', 'course', ?) "
        "ORDER BY stretch",
        [reach],
    )
    return rows.fetchall()


@pytest.mark.parametrize(("reach", "middle"), [(0, 500), (1, 700), (2, 800)])
def test_stretches_around_make_a_difference_sharper(
    rules: duckdb.DuckDBPyConnection, reach: int, middle: int
) -> None:
    intervals = [(0, 600, 1_000, 20), (1, 400, 1_000, 20), (2, 0, 1_000, 20)]
    assert sharp(rules, [0] * 3, intervals, reach)[2][0] == middle


def test_what_a_drift_brings_along(rules: duckdb.DuckDBPyConnection) -> None:
    """50 µs in a stretch are 100 ppm."""
    intervals = [(n, 50_000 * n, 50_000 * n + 1_000, 20) for n in range(3)]
    expected = [(50_000 * n + 500, 100_000) for n in range(3)]
    assert sharp(rules, [0, 50_000, 100_000], intervals, 2) == expected


@pytest.mark.parametrize("order", [1, -1])
def test_of_equal_differences_the_greatest_is_sharp(
    rules: duckdb.DuckDBPyConnection, order: int
) -> None:
    intervals = [(0, 0, 1_000, 20), (0, 4_000, 5_000, 20), (0, 2_000, 3_000, 20)][::order]
    assert sharp(rules, [0], intervals, 0) == [(4_500, 0)]


def is_sharp(con: duckdb.DuckDBPyConnection, both: int, one: int, other: int) -> bool:
    """Of messages that allow two differences, only the first, and only the second."""
    drift(con, [0])
    con.execute(
        "CREATE OR REPLACE TABLE pair (clock_id BIGINT, stretch BIGINT, written_ns BIGINT, "
        "least_ns BIGINT, greatest_ns BIGINT)"
    )
    shared = [(n, 1_000) for n in range(both)] + [(n - 4_000, 5_000) for n in range(both)]
    first = [(1_000 + n, 1_000) for n in range(one)]
    second = [(2_000 + n - 4_000, 5_000) for n in range(other)]
    con.executemany(
        "INSERT INTO pair VALUES (1, 0, ?, ? - 1000, ?)",
        [(written, greatest, greatest) for written, greatest in shared + first + second],
    )
    found = con.execute(
        "SELECT offset_ns, is_sharp FROM derive.sharp_difference('pair', 'course', 0)"
    ).fetchall()
    assert found[0][0] == 500
    return bool(found[0][1])


@pytest.mark.parametrize(("other", "expected"), [(20, True), (21, False)])
def test_a_difference_is_sharp_that_nineteen_twentieths_allow(
    rules: duckdb.DuckDBPyConnection, other: int, *, expected: bool
) -> None:
    """380 of 400 messages, or of 401."""
    assert is_sharp(rules, 350, 30, other) is expected


@pytest.mark.parametrize(("other", "expected"), [(9, True), (10, False)])
def test_or_where_less_than_that_allow_another_one(
    rules: duckdb.DuckDBPyConnection, other: int, *, expected: bool
) -> None:
    """100 allow the one, 89 or 90 the other; of 109 and 110."""
    assert is_sharp(rules, 80, 20, other) is expected


@pytest.mark.parametrize(("votes", "expected"), [(8, 1_500), (7, 0)])
def test_a_sharp_difference_takes_a_quorum(
    rules: duckdb.DuckDBPyConnection, votes: int, expected: int
) -> None:
    assert sharp(rules, [0], [(0, 1_000, 2_000, votes)], 0) == [(expected, 0)]


@pytest.mark.parametrize(("step", "segment"), [(190_000, 0), (210_000, 1)])
def test_what_a_drift_can_lead_to_is_no_jump(
    rules: duckdb.DuckDBPyConnection, step: int, segment: int
) -> None:
    """In this stretch and since the one before."""
    found = followed(rules, [[(0, 0, 20)], *([(step, 0, 20)] for _ in range(3))])
    assert found[1] == (step, 20, segment)


@pytest.mark.parametrize(("apart", "is_known"), [(450_000, True), (550_000, False)])
def test_remote_differences_a_period_apart_tell_nothing(
    rules: duckdb.DuckDBPyConnection, apart: int, *, is_known: bool
) -> None:
    """Within a burst the one of most messages is right."""
    stretch = [(3_000_000, 500, 20), (3_000_000 + apart, 500, 19)]
    found = followed(rules, [stretch] * 3, is_here=False)
    assert found == [(3_000_000, 20, 1) if is_known else (0, 0, 0)] * 3


@pytest.mark.parametrize(("apart", "is_known"), [(450_000, True), (550_000, False)])
def test_a_later_publication_that_fits_as_well_tells_nothing(
    rules: duckdb.DuckDBPyConnection, apart: int, *, is_known: bool
) -> None:
    found = followed(rules, [[(0, 500, 20), (-apart, 500, 19)]])
    assert found == [(0, 20 if is_known else 0, 0)]


def test_what_came_before_is_known_where_no_take_shows_a_step(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """Messages begin to wait in a queue."""
    old, both = [(0, 500, 20)], [(0, 500, 20), (-3_000_000, 500, 19)]
    assert followed(rules, [old, old, both, both])[:3] == [(0, 20, 0), (0, 20, 0), (0, 0, 0)]


@pytest.mark.parametrize(
    ("until_next", "until_later", "is_jump"),
    [
        (190_000, 200_000, True),
        (210_000, 200_000, False),
        (150_000, 290_000, True),
        (150_000, 310_000, False),
    ],
)
def test_what_agrees_with_a_jump_may_drift(
    rules: duckdb.DuckDBPyConnection, until_next: int, until_later: int, *, is_jump: bool
) -> None:
    """A wander for each stretch, and one more."""
    jump = 3_000_000
    found = followed(
        rules,
        [
            [(0, 0, 20)],
            [(jump, 0, 20)],
            [(jump + until_next, 0, 20)],
            [(jump + until_later, 0, 20)],
            [(9_000_000, 0, 20)],
            [(1_000_000, 0, 20)],
        ],
    )
    assert found[1] == ((jump, 20, 1) if is_jump else (0, 0, 0))


@pytest.mark.parametrize(("apart", "chosen"), [(450_000, 1), (550_000, 0)])
def test_a_jump_is_to_the_least_difference_but_for_bursts(
    rules: duckdb.DuckDBPyConnection, apart: int, chosen: int
) -> None:
    """Within a burst the one of most messages is right."""
    regions = [(3_000_000, 500, 19), (3_000_000 + apart, 500, 20)]
    found = followed(rules, [[(0, 500, 20)], *[regions] * 3])
    assert found[1][0] == regions[chosen][0]


def test_of_differences_that_a_drift_can_lead_to_the_one_of_most_messages(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    assert followed(rules, [[(0, 500, 19), (50_000, 500, 20)]])[0][:2] == (50_000, 20)
    assert followed(rules, [[(0, 500, 20), (50_000, 500, 20)]])[0][:2] == (0, 20)
