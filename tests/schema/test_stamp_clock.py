"""The clock of stamps of a publisher of known delays, from its publications and messages."""

from __future__ import annotations

import duckdb
import pytest
from support.rules import insert
from support.thorough import few

SECOND = 1_000_000_000
PERIOD = 10_000_000
Line = tuple[int | None, int | None, int, int, int]


def record(
    con: duckdb.DuckDBPyConnection,
    *differences: int,
    ppm: int = 0,
    count: int = 400,
    per_burst: int = 1,
    width: int = 2_000,
    clock_id: int = 1,
) -> list[Line]:
    """Lines of a clock that goes from one difference to the next after equal times.

    A write takes `width`, and is stamped up to 1 µs after 500 ns. It is taken on `clock_id`.
    """
    con.execute(
        """INSERT INTO published (publication_id, written_ns, closes_ns)
        SELECT n, written_ns, written_ns + $width FROM (
            SELECT n, n // $burst * 10000000 + n % $burst * $width + hash(n // $burst) % 80000
                AS written_ns
            FROM range($count * $burst) AS r(n)
        )""",
        {"width": width, "burst": per_burst, "count": count},
    )
    con.execute(
        """INSERT INTO message (source_timestamp_ns, taken_ns, clock_id)
        SELECT
            at_ns + at_ns * $ppm // 1000000
            + $differences[1 + publication_id * len($differences) // $all],
            at_ns + 200000, $clock
        FROM (
            SELECT
                publication_id,
                written_ns + 500 + (hash(publication_id, 7) % 1000)::BIGINT AS at_ns
            FROM published
        )""",
        {
            "ppm": ppm, "differences": list(differences or [0]), "all": count * per_burst,
            "clock": clock_id,
        },
    )  # fmt: skip
    return lines(con)


def lines(con: duckdb.DuckDBPyConnection) -> list[Line]:
    return con.execute(
        "SELECT start_ns, end_ns, difference_ns, drift_ppb, slack_ns FROM derive.stamp_clock(1) "
        "ORDER BY at_ns - difference_ns"
    ).fetchall()


@pytest.mark.parametrize("per_burst", [1, 6])
@pytest.mark.parametrize("difference", few([0, 300_000, -200_000, 7_000_000], 7_000_000))
@pytest.mark.parametrize("ppm", few([0, 20, -60], -60))
def test_one_line_for_a_clock_that_is_not_set(
    rules: duckdb.DuckDBPyConnection, per_burst: int, difference: int, ppm: int
) -> None:
    width = 2_000 if per_burst > 1 else 20_000
    ((start, end, found, drift, slack),) = record(
        rules, difference, ppm=ppm, per_burst=per_burst, width=width
    )
    assert (start, end, slack) == (None, None, 0)
    assert abs(found - difference - 2 * ppm * 1_000) < width
    assert abs(drift - ppm * 1_000) < width


def test_messages_that_fit_without_a_drift_show_none(rules: duckdb.DuckDBPyConnection) -> None:
    ((*_, drift, _),) = record(rules, 0)
    assert drift == 0


@pytest.mark.parametrize("by", few([7_000, -40_000_000, SECOND, -7200 * SECOND], -40_000_000))
def test_a_clock_that_is_set_has_a_line_on_either_side(
    rules: duckdb.DuckDBPyConnection, by: int
) -> None:
    """Of the two stretches beside it nothing is certain."""
    before, behind = record(rules, 0, by, per_burst=6)
    assert abs(before[2]) < 1_500
    assert abs(behind[2] - by) < 1_500
    for stamp, expected in ((before[1], 2 * SECOND), (behind[0], 2 * SECOND + by)):
        # Set back by hours, the later stamps are less than all others.
        assert stamp is None or abs(stamp - expected) < 500_000_000


def test_a_clock_that_is_set_twice_has_three_lines(rules: duckdb.DuckDBPyConnection) -> None:
    found = record(rules, 0, 3_000_000, -5_000_000, count=1200)
    assert [round(line[2], -4) for line in found] == [0, 3_000_000, -5_000_000]


def test_what_lasts_for_two_stretches_is_chance(rules: duckdb.DuckDBPyConnection) -> None:
    found = record(rules, *[0] * 9, 7_000, *[0] * 10, count=800)
    assert [line[:2] for line in found] == [(None, None)]


@pytest.mark.parametrize(("late", "lines_known"), [(80_000, 2), (1, 1)])
def test_messages_taken_elsewhere_tell_where_a_clock_was_set_if_they_fit_no_other_period(
    rules: duckdb.DuckDBPyConnection, late: int, lines_known: int
) -> None:
    record(rules, clock_id=2)
    rules.execute(
        "UPDATE message SET source_timestamp_ns = source_timestamp_ns "
        "+ CASE WHEN source_timestamp_ns > 2000000000 THEN 3000000 ELSE 0 END"
    )
    if late == 1:
        for table, column in (("published", "written_ns"), ("published", "closes_ns")):
            rules.execute(f"UPDATE {table} SET {column} = {column} // 10000000 * 10000000")
        rules.execute("UPDATE published SET closes_ns = written_ns + 2000")
        rules.execute(
            "UPDATE message SET source_timestamp_ns = source_timestamp_ns // 1000000 * 1000000 "
            "+ 900"
        )
    assert len(lines(rules)) == lines_known


def test_what_fits_a_drift_and_a_small_step_has_the_slack_of_both(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """Each message allows 30 µs; a clock that is set by 32 µs could as well have drifted."""
    ((*_, drift, slack),) = record(rules, 0, 32_000, width=30_000)
    assert (drift > 10_000, slack > 40_000) == (True, True)


def test_a_drift_that_no_step_explains_is_known_sharply(rules: duckdb.DuckDBPyConnection) -> None:
    ((*_, drift, slack),) = record(rules, ppm=20, count=1_600, width=30_000)
    assert (abs(drift - 20_000) < 1_000, slack) == (True, 0)


@pytest.mark.parametrize("back", [1, 2])
def test_stamps_of_two_times_are_not_certain(rules: duckdb.DuckDBPyConnection, back: int) -> None:
    """The clock is set back while recording: stamps of some seconds are made twice."""
    for _, end, difference, *_ in record(rules, 0, -back * SECOND - 3_000_000, count=800):
        if abs(difference) < 1_500:
            assert end is not None
            assert end < (4 - back) * SECOND


def test_where_a_message_was_published_shows_by_takes_on_other_clocks(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """A clock was set by more than the publications that are looked at beside a stamp."""
    record(rules, clock_id=2, count=800)
    rules.execute("UPDATE message SET taken_ns = taken_ns + 7000000000")
    rules.execute(
        "UPDATE message SET source_timestamp_ns = source_timestamp_ns + 1003000000 "
        "WHERE source_timestamp_ns > 4000000000"
    )
    assert [round(line[2], -4) for line in lines(rules)] == [0, 1_003_000_000]


@pytest.mark.parametrize("by", [-PERIOD, PERIOD])
def test_a_clock_that_is_set_by_a_period_is_not_known_as_before(
    rules: duckdb.DuckDBPyConnection, by: int
) -> None:
    for _, end, difference, *_ in record(rules, 0, by):
        assert abs(difference - by) < 1_500 or (
            abs(difference) < 1_500 and end is not None and end < 2 * SECOND
        )


def test_each_host_has_its_own_clock(rules: duckdb.DuckDBPyConnection) -> None:
    record(rules, 300_000)
    rules.execute(
        "INSERT INTO published SELECT * REPLACE (2 AS clock_id, 2 AS publisher_id, "
        "'/b' AS topic_name) FROM published"
    )
    rules.execute(
        "INSERT INTO message SELECT * REPLACE (2 AS clock_id, '/b' AS topic_name, "
        "source_timestamp_ns + 5000 AS source_timestamp_ns) FROM message"
    )
    first, second = sorted(difference for _, _, difference, *_ in lines(rules))
    assert abs(first - 300_000) < 1_500
    assert abs(second - 305_000) < 1_500


@pytest.mark.parametrize(("count", "known"), [(7, 0), (8, 1)])
def test_eight_messages_tell_the_difference(
    rules: duckdb.DuckDBPyConnection, count: int, known: int
) -> None:
    assert len(record(rules, count=count)) == known


@pytest.mark.parametrize(("count", "slack"), [(48, 500_000), (72, 0)])
def test_two_stretches_do_not_tell_bursts_apart(
    rules: duckdb.DuckDBPyConnection, count: int, slack: int
) -> None:
    assert [line[4] for line in record(rules, count=count)] == [slack]


@pytest.mark.parametrize("lost", [0, 1])
def test_a_publication_has_one_message(rules: duckdb.DuckDBPyConnection, lost: int) -> None:
    """Else a burst could as well be one publication later, if its last one takes long."""
    record(rules, per_burst=4)
    rules.execute("UPDATE published SET closes_ns = closes_ns + 50000 WHERE publication_id % 4 = 3")
    rules.execute("DELETE FROM published WHERE publication_id % 41 = 0 AND ?", [lost == 1])
    ((*_, difference, _, slack),) = lines(rules)
    assert (abs(difference) < 1_500, slack) == (True, 0)


def test_a_long_recording_is_sampled(rules: duckdb.DuckDBPyConnection) -> None:
    """Every other one of 400 stretches, and clocks are certain from the first to the last."""
    assert [line[:2] for line in record(rules, count=48 * 400)] == [(None, None)]
    count = rules.sql("SELECT count(DISTINCT source_timestamp_ns) FROM derive.stamp_pair(1)")
    assert count.fetchall() == [(48 * 134,)]


def test_a_message_counts_once_however_many_publish_on_its_topic(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """Each of 400 is looked for among the publications of five, and 48 vote together."""
    record(rules)
    rules.execute(
        "INSERT INTO published SELECT p.* REPLACE (r.n AS publisher_id) "
        "FROM published AS p, range(2, 6) AS r(n)"
    )
    count = rules.sql(
        "SELECT count(DISTINCT source_timestamp_ns) FROM derive.stamp_pair(1) GROUP BY stretch"
    )
    assert sorted(count.fetchall()) == [(400 % 48,)] + [(48,)] * (400 // 48)


@pytest.mark.parametrize(
    ("least", "greatest", "expected"), [(0, 6_000, 3_000), (0, 8_000, 4_000), (0, 20_000, 16_000)]
)
def test_where_few_differences_are_left_the_middle_one_else_one_near_the_greatest(
    rules: duckdb.DuckDBPyConnection, least: int, greatest: int, expected: int
) -> None:
    rules.execute(
        "CREATE TABLE intervals AS SELECT 1 AS clock_id, 1 AS stretch, ?::BIGINT AS least_ns, "
        "?::BIGINT AS greatest_ns",
        [least, greatest],
    )
    found = rules.sql(
        "SELECT difference_ns FROM derive.agreed_difference('intervals', 0.9)"
    ).fetchall()
    assert found == [(expected,)]


@pytest.mark.parametrize(("votes", "ranges"), [(8, 1), (9, 2)])
def test_a_difference_that_nearly_as_many_messages_allow_may_be_right(
    rules: duckdb.DuckDBPyConnection, votes: int, ranges: int
) -> None:
    rules.execute(
        "CREATE TABLE intervals (clock_id BIGINT DEFAULT 1, stretch BIGINT DEFAULT 1, "
        "least_ns BIGINT, greatest_ns BIGINT)"
    )
    rows = [(0, 10)] * 10 + [(20, 30)] * votes
    insert(rules, "intervals", "least_ns, greatest_ns", rows)
    found = rules.sql("FROM derive.agreed_difference('intervals', 0.9)").fetchall()
    assert len(found) == ranges
