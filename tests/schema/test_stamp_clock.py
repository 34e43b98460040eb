"""The clock of stamps of a publisher of known delays, from its publications and messages."""

from __future__ import annotations

from typing import Any

import duckdb
import pytest
from support.thorough import few, thorough

SECOND = 1_000_000_000
PERIOD_NS = 10_000_000
COUNT = 400
STRETCH_NS = 498_750_001


def record(
    con: duckdb.DuckDBPyConnection,
    *,
    width_ns: int,
    delay_ns: int,
    ppm: int,
    count: int = COUNT,
    per_burst: int = 1,
    period_ns: int = PERIOD_NS,
) -> list[tuple[Any, ...]]:
    """Clock of stamps where each write takes `width_ns` and is stamped up to `delay_ns` later."""
    con.execute(
        "INSERT INTO published (publication_id, written_ns, next_event_ns) SELECT n, written_ns, "
        "written_ns + $width FROM (SELECT n, n // $burst * $period + n % $burst * $width "
        "+ CASE WHEN n // $burst IN (0, $count - 1) THEN 0 ELSE hash(n // $burst) % 80000 END "
        "AS written_ns FROM range($count * $burst) AS r(n))",
        {"width": width_ns, "burst": per_burst, "period": period_ns, "count": count},
    )
    con.execute(
        "INSERT INTO message (source_timestamp_ns, taken_ns) "
        "SELECT stamp + stamp * $ppm // 1000000, stamp + 200000 FROM (SELECT written_ns + 500 "
        "+ (hash(publication_id, 7) % $delay)::BIGINT AS stamp FROM published)",
        {"ppm": ppm, "delay": delay_ns},
    )
    return con.execute(
        "SELECT start_ns, at_ns, end_ns, difference_ns, drift_ppb, message_count, segment, "
        "is_sharp "
        "FROM derive.stamp_clock(1) ORDER BY start_ns"
    ).fetchall()


@pytest.mark.parametrize("ppm", few([0, 150, -150], -150))
def test_difference_and_drift_of_each_stretch(rules: duckdb.DuckDBPyConnection, ppm: int) -> None:
    """The messages of a stretch agree only once its drift is known."""
    rows = record(rules, width_ns=2_000, delay_ns=1_000, ppm=ppm)
    assert len(rows) == 8
    for n, (start, at, end, difference, drift, count, segment, _) in enumerate(rows):
        assert (start, end) == (n * STRETCH_NS, (n + 1) * STRETCH_NS)
        assert at == start + STRETCH_NS // 2
        assert abs(difference - at * ppm // 1_000_000) < 1_500
        assert abs(drift - ppm * 1_000) < 5_000
        assert count >= 24
        assert segment == 0


@pytest.mark.parametrize(
    ("seconds", "count", "stretches"),
    [
        pytest.param(2, 400, 8, id="a_short_recording_has_eight"),
        pytest.param(20, 1_200, 39, id="half_a_second_each"),
        pytest.param(20, 120, 10, id="with_twelve_messages_or_more"),
        pytest.param(1_000, 12_000, 600, id="and_never_more_than_600"),
    ],
)
def test_how_many_stretches_a_recording_has(
    rules: duckdb.DuckDBPyConnection, seconds: int, count: int, stretches: int
) -> None:
    period = seconds * SECOND // count
    rules.execute(
        "INSERT INTO published (publication_id, written_ns, next_event_ns) "
        "SELECT n, n * $period, n * $period + 2000 FROM range($count) AS r(n)",
        {"period": period, "count": count},
    )
    rules.execute(
        "INSERT INTO message (source_timestamp_ns, taken_ns) "
        "SELECT written_ns + 500, written_ns + 200000 FROM published"
    )
    rows = rules.execute("SELECT DISTINCT stretch_ns FROM derive.stamp_pair(1)").fetchall()
    assert rows == [(1 + (count - 1) * period // stretches,)]


@pytest.mark.parametrize(("clock", "count"), [(1, 49 + 25), (2, 49)])
def test_which_publications_a_message_may_be_of(
    rules: duckdb.DuckDBPyConnection, clock: int, count: int
) -> None:
    """24 on either side of its stamp; and 24 before it was taken, if by the same clock."""
    rules.execute(
        "INSERT INTO published (publication_id, written_ns, next_event_ns) "
        "SELECT n, n * 1000000, n * 1000000 + 2000 FROM range(200) AS r(n)"
    )
    rules.execute(
        "INSERT INTO message (source_timestamp_ns, taken_ns, clock_id) "
        "VALUES (100000500, 180200000, ?)",
        [clock],
    )
    rows = rules.execute("SELECT count(DISTINCT written_ns) FROM derive.stamp_pair(1)").fetchall()
    assert rows == [(count,)]


def test_a_message_that_waited_on_another_clock_is_near_its_stamp_or_its_take(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """Either may mislead: the clock of stamps may be set, and messages wait in queues."""
    rules.execute(
        "INSERT INTO published (publication_id, written_ns, next_event_ns) "
        "SELECT n, n * 1000000, n * 1000000 + 2000 FROM range(200) AS r(n)"
    )
    rules.execute(
        "INSERT INTO message (source_timestamp_ns, taken_ns, clock_id) "
        "VALUES (500, 200500, 2), (100000500, 180200000, 2)"
    )
    rows = rules.execute(
        "SELECT written_ns // 1000000 FROM derive.stamp_pair(1) "
        "WHERE written_ns + greatest_ns = 100000500 ORDER BY written_ns"
    ).fetchall()
    assert [place for (place,) in rows] == [*range(76, 125), *range(156, 200)]


@pytest.mark.parametrize(
    ("least", "greatest", "difference"), [(0, 6_000, 3_000), (0, 8_002, 4_002), (0, 90_000, 86_000)]
)
def test_where_few_differences_are_left_the_middle_one_else_one_near_the_greatest(
    rules: duckdb.DuckDBPyConnection, least: int, greatest: int, difference: int
) -> None:
    """The shortest delay is known to 4 µs."""
    rules.execute(
        "CREATE TABLE allowed AS SELECT 1 AS clock_id, 0 AS stretch, ?::BIGINT AS least_ns, "
        "?::BIGINT AS greatest_ns FROM range(10)",
        [least, greatest],
    )
    rows = rules.execute(
        "SELECT difference_ns, least_ns, greatest_ns, vote_count "
        "FROM derive.agreed_difference('allowed')"
    ).fetchall()
    assert rows == [(difference, least, greatest, 10)]


@pytest.mark.parametrize(("rival", "count"), [(90, 2), (89, 1)])
def test_a_difference_that_nearly_as_many_messages_allow_may_be_right(
    rules: duckdb.DuckDBPyConnection, rival: int, count: int
) -> None:
    """Nine in ten of the messages that agree with the best one."""
    rules.execute(
        "CREATE TABLE allowed AS SELECT 1 AS clock_id, 0 AS stretch, 0 AS least_ns, "
        "1000 AS greatest_ns FROM range(100) "
        "UNION ALL SELECT 1, 0, 1000000, 1001000 FROM range(?)",
        [rival],
    )
    rows = rules.execute("SELECT vote_count FROM derive.agreed_difference('allowed')").fetchall()
    assert sorted(rows, reverse=True) == [(100,), (rival,)][:count]


@pytest.mark.parametrize(
    ("agreeing", "rival", "is_sharp"),
    [
        pytest.param(95, 95, True, id="nearly_all_agree"),
        pytest.param(94, 94, False, id="fewer_do_and_may_be_wrong"),
        pytest.param(50, 44, True, id="fewer_do_but_no_other_is_a_rival"),
    ],
)
def test_a_difference_is_sharp_if_nearly_all_agree_or_no_other_is_a_rival(
    rules: duckdb.DuckDBPyConnection, agreeing: int, rival: int, *, is_sharp: bool
) -> None:
    """Of a hundred messages; a few fit with no publication that another one fits with."""
    rules.execute(
        "CREATE TABLE pairs AS SELECT 1 AS clock_id, 0 AS stretch, n * 100 - apart AS written_ns, "
        "apart - 10 AS least_ns, apart AS greatest_ns "
        "FROM (SELECT n, unnest([CASE WHEN n < $agreeing THEN 10 ELSE 2000000 + n * 100 END, "
        "CASE WHEN n < $rival THEN 1000000 END]) AS apart FROM range(100) AS r(n)) "
        "WHERE apart IS NOT NULL",
        {"agreeing": agreeing, "rival": rival},
    )
    rules.execute(
        "CREATE TABLE course AS SELECT 1 AS clock_id, 0 AS place, 0 AS stretch, 0 AS at_ns, "
        "0 AS offset_ns"
    )
    rows = rules.execute(
        "SELECT is_sharp FROM derive.sharp_difference('pairs', 'course', 0)"
    ).fetchall()
    assert rows == [(is_sharp,)]


@pytest.mark.parametrize(("stretches", "is_sharp"), [(1, False), (2, False), (3, True)])
def test_a_drift_takes_three_stretches(
    rules: duckdb.DuckDBPyConnection, stretches: int, *, is_sharp: bool
) -> None:
    """Of twelve messages each; two agree with some drift by chance."""
    rows = record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, count=12 * stretches)
    assert [row[7] for row in rows] == [is_sharp] * stretches


@pytest.mark.parametrize("ppm", few([0, 190, -190], 190))
def test_bursts_are_told_at_any_drift(rules: duckdb.DuckDBPyConnection, ppm: int) -> None:
    """A drift known to 2 ppm only moves a message to the next publication within a second."""
    rows = record(rules, width_ns=2_000, delay_ns=1_000, ppm=ppm, per_burst=6)
    assert len(rows) == 8
    for _, at, _, difference, drift, _, _, is_sharp in rows:
        assert abs(difference - at * ppm // 1_000_000) < 600
        assert abs(drift - ppm * 1_000) < 500
        assert is_sharp


@pytest.mark.parametrize("apart_ns", [2_000, 3_000, 4_000])
def test_a_publication_has_one_message(rules: duckdb.DuckDBPyConnection, apart_ns: int) -> None:
    """A thread that goes on late behind its burst could as well be writing the one before, too."""
    record(rules, width_ns=apart_ns, delay_ns=1_000, ppm=0, per_burst=3)
    rules.execute(
        "UPDATE published SET next_event_ns = next_event_ns + 20000 WHERE publication_id % 3 = 2"
    )
    rows = rules.execute("SELECT difference_ns, is_sharp FROM derive.stamp_clock(1)").fetchall()
    assert [(2 * abs(difference) < apart_ns, is_sharp) for difference, is_sharp in rows] == [
        (True, True)
    ] * 8


def test_every_earlier_message_counts(rules: duckdb.DuckDBPyConnection) -> None:
    """Without the first publication of half of the bursts, one publication later explains as much.

    What denies it is that the last publication of a burst would have two messages. Few of them vote
    in a stretch.
    """
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, per_burst=12)
    rules.execute(
        "UPDATE published SET next_event_ns = next_event_ns + 20000 WHERE publication_id % 12 = 11"
    )
    rules.execute("DELETE FROM published WHERE publication_id % 24 = 0")
    rows = rules.execute("SELECT difference_ns, is_sharp FROM derive.stamp_clock(1)").fetchall()
    assert [(abs(difference) < 1_000, is_sharp) for difference, is_sharp in rows] == [
        (True, True)
    ] * 8


def test_each_channel_has_its_message(rules: duckdb.DuckDBPyConnection) -> None:
    """A message for one subscription does not take the place of one for another."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0)
    rules.execute(
        "INSERT INTO message (source_timestamp_ns, only_subscription_id, taken_ns) "
        "SELECT source_timestamp_ns + 300, 5, taken_ns FROM message"
    )
    rows = rules.execute(
        "SELECT stretch, count(DISTINCT written_ns + greatest_ns), count(DISTINCT written_ns + "
        "greatest_ns) FILTER (0 BETWEEN least_ns AND greatest_ns) FROM derive.stamp_pair(1) "
        "GROUP BY stretch"
    ).fetchall()
    assert len(rows) == 8
    assert all(allowed == count > 40 for _, count, allowed in rows)


def test_three_stretches_on_either_side_vote_together(rules: duckdb.DuckDBPyConnection) -> None:
    """Threads that go on late say little; the first stretch has others."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=20)
    rules.execute(
        "UPDATE published SET next_event_ns = written_ns + 1000000 WHERE written_ns >= ?",
        [STRETCH_NS],
    )
    rows = rules.execute(
        "SELECT difference_ns - at_ns * 20 // 1000000 FROM derive.stamp_clock(1) ORDER BY start_ns"
    )
    assert [abs(value) < 1_500 for (value,) in rows.fetchall()] == [True] * 4 + [False] * 4


def test_a_stretch_that_is_not_sharp_spoils_three_on_either_side(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """And it is not, if so many of the publications that it votes with are lost."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=150, count=600, per_burst=12)
    rules.execute(
        "DELETE FROM published WHERE written_ns >= ? AND hash(publication_id) % 2 = 0",
        [8 * STRETCH_NS],
    )
    rows = rules.execute("SELECT is_sharp FROM derive.stamp_clock(1) ORDER BY start_ns").fetchall()
    assert [is_sharp for (is_sharp,) in rows] == [True] * (8 - 3 - 3) + [False] * 9


def step(con: duckdb.DuckDBPyConnection, at_ns: int, by_ns: int) -> list[tuple[Any, ...]]:
    """Begin, end, difference, drift and segment where they are known, once the clock was set."""
    con.execute(
        "UPDATE message SET source_timestamp_ns = source_timestamp_ns + $by "
        "WHERE source_timestamp_ns >= $at",
        {"at": at_ns, "by": by_ns},
    )
    return con.execute(
        "SELECT start_ns, end_ns, difference_ns, drift_ppb, segment "
        "FROM derive.stamp_clock(1) WHERE message_count > 0 ORDER BY start_ns"
    ).fetchall()


def steps(con: duckdb.DuckDBPyConnection) -> list[tuple[int, int, int, int]]:
    """Between which moments the clock was set, rounded down to stretches, and from what to what."""
    con.execute(
        "INSERT INTO store.stamp_clock BY NAME "
        "SELECT * FROM derive.stamp_clock(1) WHERE NOT EXISTS (FROM store.stamp_clock)"
    )
    return con.execute(
        "SELECT start_ns // $stretch, end_ns // $stretch, before_ns, behind_ns "
        "FROM derive.clock_step(1) ORDER BY start_ns",
        {"stretch": STRETCH_NS},
    ).fetchall()


@pytest.mark.parametrize("by_ns", few([7_000, -7_000, 60_000, -60_000], -7_000))
@pytest.mark.parametrize("part", [0.0, 0.5])
def test_a_step_is_no_drift(rules: duckdb.DuckDBPyConnection, by_ns: int, part: float) -> None:
    """However small, between bursts 2 µs apart, at the begin of a stretch or in its middle."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, per_burst=6)
    at = round((4 + part) * STRETCH_NS)
    rows = step(rules, at, by_ns)
    assert {drift for *_, drift, _ in rows} == {0}
    for *_, difference, _, segment in rows:
        assert abs(difference - segment * by_ns) < 1_000
    assert {row[4] for row in rows} == {0, 1}
    # A stretch on either side is not certain, nor is the one with messages of both sides.
    ((first, last, before, behind),) = steps(rules)
    assert first <= at // STRETCH_NS < last <= first + 3
    assert (abs(before) < 1_000, abs(behind - by_ns) < 1_000) == (True, True)


@pytest.mark.parametrize("by_ns", few([50_000, -50_000], -50_000))
def test_a_step_in_a_stretch_that_a_drift_explains_better(
    rules: duckdb.DuckDBPyConnection, by_ns: int
) -> None:
    """Most messages are stamped in the middle of their write, which takes longer than the step."""
    record(rules, width_ns=60_000, delay_ns=1, ppm=0)
    rules.execute(
        "UPDATE message SET source_timestamp_ns = source_timestamp_ns "
        "+ CASE taken_ns // $period % 10 WHEN 0 THEN 5000 WHEN 5 THEN 55000 ELSE 30000 END",
        {"period": PERIOD_NS},
    )
    at = round(4.4 * STRETCH_NS)
    rows = step(rules, at, by_ns)
    assert {drift for *_, drift, _ in rows} == {0}
    assert {(round(difference, -4), segment) for *_, difference, _, segment in rows} == {
        (0, 0),
        (by_ns, 1),
    }
    ((first, last, _, _),) = steps(rules)
    assert first <= 4 < last <= first + 3


@pytest.mark.parametrize(("at", "behind"), [(4.0, 4), (4.5, 3)])
def test_a_jump_is_no_step(rules: duckdb.DuckDBPyConnection, at: float, behind: int) -> None:
    """It counts once; a stretch with messages from before and behind it tells nothing."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0)
    rows = step(rules, round(at * STRETCH_NS), -1_000_000)
    assert [(round(difference, -3), segment) for _, _, difference, _, segment in rows] == [
        (0, 0)
    ] * 4 + [(-1_000_000, 1)] * behind
    ((first, last, _, _),) = steps(rules)
    assert first <= 4 < last <= first + 3


def test_each_message_has_its_vote_in_one_stretch(rules: duckdb.DuckDBPyConnection) -> None:
    """Whatever publication it may be of: else a wrong difference could have more votes."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, count=600, per_burst=6)
    query = (
        "SELECT stretch, count(DISTINCT written_ns + greatest_ns) FROM derive.stamp_pair(1)"
        " GROUP BY stretch ORDER BY stretch"
    )
    sampled = 48
    found = rules.execute(query).fetchall()
    assert found[:-1] == [(stretch, sampled) for stretch in range(10)]
    # The last messages are taken after the last publication.
    assert found[-1][0] == 10
    rules.execute("UPDATE message SET taken_ns = taken_ns + $late", {"late": 700_000_000})
    assert [stretch for stretch, _ in rules.execute(query).fetchall()] == [*range(1, 11)]


@pytest.mark.parametrize("ahead_ns", [0, 2 * SECOND, -2 * SECOND])
def test_a_message_that_waited_votes_where_it_was_published(
    rules: duckdb.DuckDBPyConnection, ahead_ns: int
) -> None:
    """Also where the clock of stamps is wrong: others of the stretch did not wait."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, count=600)
    rules.execute(
        "UPDATE message SET taken_ns = taken_ns "
        "+ CASE WHEN taken_ns // $period % 2 = 1 THEN 100000000 ELSE 0 END, "
        "source_timestamp_ns = source_timestamp_ns + $ahead",
        {"period": PERIOD_NS, "ahead": ahead_ns},
    )
    ((share,),) = rules.execute(
        "SELECT avg((written_ns // stretch_ns = stretch)::INTEGER) FROM derive.stamp_pair(1)"
        " WHERE $ahead BETWEEN least_ns AND greatest_ns",
        {"ahead": ahead_ns},
    ).fetchall()
    assert share > 0.98


def test_no_vote_lies_before_the_first_publication(rules: duckdb.DuckDBPyConnection) -> None:
    """Where the clock was set back, stamps lie there."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0)
    step(rules, SECOND // 10, -3 * SECOND)
    assert rules.execute("SELECT min(stretch) FROM derive.stamp_pair(1)").fetchall() == [(0,)]


def test_one_step_after_another(rules: duckdb.DuckDBPyConnection) -> None:
    first, second = 1_500_000_000, 3_500_000_000
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, count=600, per_burst=6)
    step(rules, first, 7_000)
    rows = step(rules, second, 7_000)
    assert [row[4] for row in rows] == sorted(row[4] for row in rows)
    for *_, difference, _, segment in rows:
        assert abs(difference - segment * 7_000) < 1_000
    found = steps(rules)
    assert len(found) == 2
    for (before, behind, _, _), at in zip(found, (first, second), strict=True):
        assert before * STRETCH_NS <= at < (behind + 1) * STRETCH_NS
        assert behind - before <= 3


def test_a_step_behind_a_pause(rules: duckdb.DuckDBPyConnection) -> None:
    """The first messages behind it still show how the clock stood before."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, per_burst=6)
    rules.execute(
        "DELETE FROM message WHERE source_timestamp_ns BETWEEN $first AND $last",
        {"first": 4 * STRETCH_NS, "last": 5 * STRETCH_NS},
    )
    at = round(5.3 * STRETCH_NS)
    step(rules, at, 7_000)
    ((first, last, _, _),) = steps(rules)
    assert first <= 5 < last


def test_a_step_between_two_bursts(rules: duckdb.DuckDBPyConnection) -> None:
    """No message shows that the clock stood before it for any part of the stretch."""
    record(
        rules, width_ns=2_000, delay_ns=1_000, ppm=0, count=9, per_burst=15, period_ns=SECOND // 2
    )
    rows = step(rules, round(3.5 * SECOND / 2), 7_000)
    assert [row[4] for row in rows] == [0] * 4 + [1] * 4
    assert len(steps(rules)) == 1


def with_second_clock(rules: duckdb.DuckDBPyConnection, stamp: str) -> list[tuple[int, ...]]:
    """Return the pieces of two clocks: the second one makes other stamps of the same messages."""
    rules.execute(
        "INSERT INTO published SELECT * REPLACE (2 AS clock_id, '/b' AS topic_name, "
        "2 AS publisher_id) FROM published"
    )
    rules.execute(
        "INSERT INTO message SELECT * EXCLUDE (stamp) REPLACE (2 AS clock_id, '/b' AS topic_name, "
        f"{stamp} AS source_timestamp_ns) "
        "FROM (SELECT *, taken_ns - 200000 AS stamp FROM message)"
    )
    return rules.execute(
        "SELECT clock_id, start_ns, end_ns, difference_ns, drift_ppb, segment "
        "FROM derive.stamp_clock(1) WHERE message_count > 0 ORDER BY clock_id, start_ns"
    ).fetchall()


@pytest.mark.parametrize(
    ("at_ns", "by_ns"),
    [
        pytest.param(0, 0, id="stands_as_before"),
        thorough(0, 7_000, id="stands_as_behind"),
        thorough(round(4.3 * STRETCH_NS), 12_000, id="steps_soon_after"),
    ],
)
def test_another_clock_that_stands_changes_nothing(
    rules: duckdb.DuckDBPyConnection, at_ns: int, by_ns: int
) -> None:
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, per_burst=6)
    alone = step(rules, 4 * STRETCH_NS, 7_000)
    rows = with_second_clock(rules, f"stamp + CASE WHEN stamp >= {at_ns} THEN {by_ns} ELSE 0 END")
    assert [row[1:] for row in rows if row[0] == 1] == alone
    expected = {(0, 0), (by_ns, 1)} if at_ns else {(by_ns, 0)}
    assert {(round(row[3], -3), row[5]) for row in rows if row[0] == 2} == expected


def test_the_clock_of_another_host_changes_nothing(rules: duckdb.DuckDBPyConnection) -> None:
    """One steps, the other drifts."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, per_burst=6)
    alone = step(rules, 4 * STRETCH_NS, 7_000)
    rows = with_second_clock(rules, "stamp + stamp * 100 // 1000000")
    assert [row[1:] for row in rows if row[0] == 1] == alone
    assert [(round(row[4] / 1_000), row[5]) for row in rows if row[0] == 2] == [(100, 0)] * 8


def test_clocks_stand_for_three_stretches_or_it_is_not_said(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, per_burst=6)
    assert {row[4] for row in step(rules, 5 * STRETCH_NS, 7_000)} == {0, 1}
    step(rules, 5 * STRETCH_NS, -7_000)
    assert {row[4] for row in step(rules, 6 * STRETCH_NS, 7_000)} == {0}


@pytest.mark.parametrize(
    ("agreeing", "found", "stands"),
    [
        pytest.param(99, [4_000, 4_000, 4_000], True, id="nearly_all_messages"),
        pytest.param(98, [4_000, 4_000, 4_000], False, id="fewer"),
        pytest.param(100, [4_000, 4_000], False, id="of_two_stretches"),
        pytest.param(100, [0, 4_000, 8_000], True, id="what_looks_like_a_drift_may_be_chance"),
        pytest.param(100, [0, 4_000, 8_001], False, id="a_drift"),
        pytest.param(100, [7_000, 3_000, -1], False, id="backward"),
    ],
)
def test_clocks_stood_where_one_difference_explains_what_several_do(
    rules: duckdb.DuckDBPyConnection, agreeing: int, found: list[int], *, stands: bool
) -> None:
    """A hundred messages a second; all differences from 0 to 8 µs explain those of a second."""
    stretches = len(found)
    rules.execute(
        "CREATE TABLE pairs AS SELECT 1 AS clock_id, stretch, "
        "CASE WHEN n < $agreeing THEN 0 ELSE 50000 + 9000 * stretch END AS least_ns, "
        "least_ns + 8000 AS greatest_ns "
        "FROM range($stretches) AS s(stretch), range(100) AS r(n)",
        {"agreeing": agreeing, "stretches": stretches},
    )
    rules.execute(
        "CREATE TABLE chosen AS SELECT 1 AS clock_id, 0 AS place, stretch, "
        "$found[stretch + 1] AS offset_ns, 0 AS least_ns, 8000 AS greatest_ns, "
        "100 AS most_count FROM range($stretches) AS s(stretch)",
        {"found": found, "stretches": stretches},
    )
    rows = rules.execute(
        "SELECT difference_ns FROM derive.standing_difference('pairs', 'chosen')"
    ).fetchall()
    assert rows == ([(4_000,)] * stretches if stands else [])


@pytest.mark.parametrize(("jumps_at", "count"), [(3, 2), (6, 1)])
def test_a_clock_that_has_jumped_does_not_stand_as_before(
    rules: duckdb.DuckDBPyConnection, jumps_at: int, count: int
) -> None:
    """Even if the ranges of the differences overlap."""
    rules.execute(
        "CREATE TABLE pairs AS SELECT 1 AS clock_id, stretch, 0 AS least_ns, 8000 AS greatest_ns "
        "FROM range(6) AS s(stretch), range(100) AS r(n)"
    )
    rules.execute(
        "CREATE TABLE chosen AS SELECT 1 AS clock_id, stretch // ? AS place, stretch, "
        "stretch * 1000000000 AS at_ns, 0 AS offset_ns, 0 AS least_ns, 8000 AS greatest_ns, "
        "100 AS most_count FROM range(6) AS s(stretch)",
        [jumps_at],
    )
    rows = rules.execute(
        "SELECT span FROM derive.standing_difference('pairs', 'chosen')"
    ).fetchall()
    assert (len(rows), len(set(rows))) == (6, count)


def test_where_nothing_is_told_a_clock_that_stood_stands(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """For however long, if it stands as before then."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, count=800)
    rules.execute(
        "DELETE FROM message WHERE source_timestamp_ns BETWEEN $first AND $last",
        {"first": 7 * SECOND // 2, "last": 11 * SECOND // 2},
    )
    rows = rules.execute(
        "SELECT message_count > 0, difference_ns, segment FROM derive.stamp_clock(1)"
    ).fetchall()
    assert {known for known, *_ in rows} == {True}
    assert len({(difference, segment) for _, difference, segment in rows}) == 1


@pytest.mark.parametrize("count", few([1, 2, 3], 3))
def test_stretches_that_tell_nothing_between_two_in_which_a_clock_stood_alike(
    rules: duckdb.DuckDBPyConnection, count: int
) -> None:
    """There the timer is never late, and its messages waited: they may be those of later ones."""
    rules.execute(
        "INSERT INTO published (publication_id, written_ns, next_event_ns) SELECT n, written_ns, "
        "written_ns + 2000 FROM (SELECT n, n * $period + CASE WHEN n BETWEEN 150 AND $last "
        "OR n IN (0, $count - 1) THEN 0 ELSE hash(n) % 80000 END AS written_ns "
        "FROM range($count) AS r(n))",
        {"period": PERIOD_NS, "count": COUNT, "last": 149 + 50 * count},
    )
    rules.execute(
        "INSERT INTO message (source_timestamp_ns, taken_ns) "
        "SELECT written_ns + 500 + (hash(publication_id, 7) % 1000)::BIGINT, written_ns + CASE "
        "WHEN publication_id BETWEEN 150 AND $last THEN 25000000 ELSE 200000 END FROM published",
        {"last": 149 + 50 * count},
    )
    rows = rules.execute(
        "SELECT message_count > 0, difference_ns, segment FROM derive.stamp_clock(1)"
    ).fetchall()
    assert len(rows) == 8
    assert {known for known, *_ in rows} == {True}
    assert len({(difference, segment) for _, difference, segment in rows}) == 1


HOURS_NS = 3 * 3_600 * SECOND


@pytest.mark.parametrize("by_ns", few([HOURS_NS, -HOURS_NS], HOURS_NS))
def test_a_clock_that_is_set_by_hours(rules: duckdb.DuckDBPyConnection, by_ns: int) -> None:
    """Its stamps are before and behind all that was published."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0)
    rows = step(rules, 4 * STRETCH_NS, by_ns)
    found = [(round(difference / SECOND), segment) for _, _, difference, _, segment in rows]
    assert set(found) == {(0, 0), (by_ns // SECOND, 1)}


@pytest.mark.parametrize("by_ns", few([HOURS_NS, -HOURS_NS], -HOURS_NS))
@pytest.mark.parametrize("apart_ns", few([0, HOURS_NS], HOURS_NS))
def test_a_clock_that_is_set_by_hours_while_only_others_take_its_messages(
    rules: duckdb.DuckDBPyConnection, by_ns: int, apart_ns: int
) -> None:
    """When they were taken tells when they were published, however far the clocks are apart."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0)
    rules.execute("UPDATE message SET clock_id = 2, taken_ns = taken_ns + ?", [apart_ns])
    rows = step(rules, 4 * STRETCH_NS, by_ns)
    found = [(round(difference / SECOND), segment) for _, _, difference, _, segment in rows]
    assert set(found) == {(0, 0), (by_ns // SECOND, 1)}
    assert next(row[0] for row in rows if row[4] == 1) <= 4 * STRETCH_NS


@pytest.mark.parametrize("by_ns", few([3 * SECOND, -3 * SECOND], -3 * SECOND))
@pytest.mark.parametrize("is_wrong", few(["before", "behind"], "before"))
@pytest.mark.parametrize("apart_ns", few([0, HOURS_NS], HOURS_NS))
def test_a_clock_that_is_right_in_the_beginning_or_in_the_end(
    rules: duckdb.DuckDBPyConnection, is_wrong: str, by_ns: int, apart_ns: int
) -> None:
    """Only another host takes its messages: a robot may also boot with a clock that is wrong."""
    record(rules, width_ns=2_000, delay_ns=1_000, ppm=0, count=1_600)
    rules.execute("UPDATE message SET clock_id = 2, taken_ns = taken_ns + ?", [apart_ns])
    at = 8 * SECOND
    comparison = "<" if is_wrong == "before" else ">="
    rules.execute(
        "UPDATE message SET source_timestamp_ns = source_timestamp_ns + $by "
        f"WHERE source_timestamp_ns {comparison} $at",
        {"at": at, "by": by_ns},
    )
    rows = rules.execute(
        "SELECT end_ns, round(difference_ns / 1e9), message_count > 0 "
        "FROM derive.stamp_clock(1) ORDER BY start_ns"
    ).fetchall()
    assert {is_known for *_, is_known in rows} == {True}
    before, behind = (by_ns, 0) if is_wrong == "before" else (0, by_ns)
    assert {seconds for end, seconds, _ in rows if end < at} == {before // SECOND}
    assert {seconds for end, seconds, _ in rows if end > at + SECOND} == {behind // SECOND}


@pytest.mark.parametrize(("here", "is_known"), [(10, True), (7, True), (6, False), (0, False)])
def test_messages_of_a_stretch_are_taken_where_half_of_them_are(
    rules: duckdb.DuckDBPyConnection, here: int, *, is_known: bool
) -> None:
    """Of a timer that is never late only the clock that they were taken on tells the period.

    Half of the pairs: messages taken elsewhere have nearly twice as many.
    """
    rules.execute(
        "INSERT INTO published (publication_id, written_ns, next_event_ns) "
        "SELECT n, n * $period, n * $period + 2000 FROM range($count) AS r(n)",
        {"period": PERIOD_NS, "count": COUNT},
    )
    rules.execute(
        "INSERT INTO message (source_timestamp_ns, taken_ns, clock_id) "
        "SELECT written_ns + 3000500, written_ns + 200000, "
        "CASE WHEN publication_id % 10 < $here THEN 1 ELSE 2 END FROM published",
        {"here": here},
    )
    rows = rules.execute("SELECT message_count > 0 FROM derive.stamp_clock(1)").fetchall()
    assert {known for (known,) in rows} == {is_known}
