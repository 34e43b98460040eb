"""Which publication a message is of, where the clocks are known: each rule from both sides."""

from __future__ import annotations

from collections.abc import Iterable

import duckdb
import pytest
from support.rules import insert

MICROSECOND = 1_000
MILLISECOND = 1_000_000
SECOND = 1_000_000_000
PERIOD = 100 * MILLISECOND

Row = tuple[int, int | None, int | None]


def clock(
    con: duckdb.DuckDBPyConnection, *lines: tuple[int, int | None, int | None], slack: int = 0
) -> None:
    """(difference, first stamp, last stamp) of each time in which the clock is certain."""
    rows = [(*line, slack) for line in lines or [(0, None, None)]]
    insert(con, "store.stamp_clock", "difference_ns, start_ns, end_ns, slack_ns", rows)


def publish(
    con: duckdb.DuckDBPyConnection,
    identity: int,
    written: int,
    closes: int | None,
    topic: str = "/a",
    *,
    publisher: int | None = None,
    thread: int = 1,
) -> None:
    """A publication and when its thread went on; one publisher for each topic, unless given."""
    names = "publication_id, written_ns, closes_ns, topic_name, publisher_id, thread_id"
    row = (identity, written, closes, topic, publisher or ord(topic[1]), thread)
    insert(con, "published", names, [row])


def take(
    con: duckdb.DuckDBPyConnection, *stamps: int, topic: str = "/a", taken: int = 100 * SECOND
) -> None:
    names = "source_timestamp_ns, topic_name, taken_ns"
    insert(con, "message", names, [(stamp, topic, taken) for stamp in stamps])


def periodic(
    con: duckdb.DuckDBPyConnection,
    delays: Iterable[int],
    width: int,
    since: int = 0,
    topic: str = "/a",
    first: int | None = None,
) -> int:
    """Publications one period apart, each with a message; returns the time of the next one.

    They are numbered from `first` on, or by the periods before `since`.
    """
    begin = since // PERIOD if first is None else first
    times = [(since + n * PERIOD, delay) for n, delay in enumerate(delays)]
    insert(
        con,
        "published",
        "publication_id, written_ns, closes_ns, topic_name, publisher_id",
        [(n, time, time + width, topic, ord(topic[1])) for n, (time, _) in enumerate(times, begin)],
    )
    take(con, *(time + delay for time, delay in times), topic=topic)
    return since + len(times) * PERIOD


def nearest(con: duckdb.DuckDBPyConnection) -> dict[int, tuple[int | None, int | None]]:
    """Publication and number of candidates by stamp."""
    rows = con.execute(
        "SELECT source_timestamp_ns, publication_id, candidate_count FROM derive.nearest_message(1)"
    ).fetchall()
    found = {stamp: (publication, count) for stamp, publication, count in rows}
    assert len(found) == len(rows)
    return found


@pytest.mark.parametrize(
    ("stamp", "taken", "is_found"),
    [
        (99_999, SECOND, False),
        (100_000, SECOND, True),
        (149_999, SECOND, True),
        (150_000, SECOND, False),
        (149_999, 100_001, True),
        (149_999, 100_000, False),
    ],
)
def test_a_message_is_stamped_within_its_write_and_taken_behind(
    rules: duckdb.DuckDBPyConnection, stamp: int, taken: int, *, is_found: bool
) -> None:
    clock(rules)
    publish(rules, 1, 100_000, 150_000)
    publish(rules, 2, 200_000, 250_000)
    publish(rules, 3, 300_000, 350_000)
    take(rules, stamp, taken=taken)
    take(rules, 210_000, 310_000)
    expected = {210_000: (2, 1), 310_000: (3, 1)}
    assert nearest(rules) == expected | ({stamp: (1, 1)} if is_found else {})


@pytest.mark.parametrize(
    ("clocks", "is_found"),
    [
        pytest.param([1, 1], False, id="first_here"),
        pytest.param([1, 2], False, id="here_and_elsewhere"),
        pytest.param([2, 1], True, id="first_elsewhere"),
        pytest.param([2, 2], True, id="elsewhere"),
    ],
)
def test_only_a_take_on_its_clock_tells_that_a_message_was_there(
    rules: duckdb.DuckDBPyConnection, clocks: list[int], *, is_found: bool
) -> None:
    """The first of two takes is before the write."""
    clock(rules)
    publish(rules, 1, 100_000, 150_000)
    for clock_id, taken in zip(clocks, (50_000, 160_000), strict=True):
        rules.execute(
            "INSERT INTO message (source_timestamp_ns, clock_id, taken_ns) VALUES (120000, ?, ?)",
            [clock_id, taken],
        )
    assert nearest(rules) == {120_000: (1, 1) if is_found else (None, 0)}


@pytest.mark.parametrize("second", ["thread", "publisher"])
def test_all_writes_that_go_on_come_into_question(
    rules: duckdb.DuckDBPyConnection, second: str
) -> None:
    """Of threads that share a publisher, and of publishers; also an earlier one."""
    clock(rules)
    time = periodic(rules, [10_000] * 10, MILLISECOND)
    publish(rules, 998, time, time + 900_000)
    publish(rules, 999, time + 100_000, time + 500_000, **{second: 2})
    take(rules, time + 200_000, time + 300_000)
    found = nearest(rules)
    assert found[time + 200_000] == found[time + 300_000] == (None, 2)


@pytest.mark.parametrize("first", [50_000, 600_000])
@pytest.mark.parametrize("second", ["thread", "publisher"])
def test_a_publication_that_has_its_message_has_no_other(
    rules: duckdb.DuckDBPyConnection, second: str, first: int
) -> None:
    """One message can only be of the longer write, so that the other is of the shorter."""
    clock(rules)
    time = periodic(rules, [10_000] * 10, MILLISECOND)
    publish(rules, 998, time, time + 900_000)
    publish(rules, 999, time + 100_000, time + 500_000, **{second: 2})
    take(rules, time + first, time + 200_000)
    found = nearest(rules)
    assert (found[time + first], found[time + 200_000]) == ((998, 1), (999, 1))


def take_alone(con: duckdb.DuckDBPyConnection, subscription: int, *stamps: int) -> None:
    """Messages that a subscription gets with stamps of its own."""
    names = "source_timestamp_ns, only_subscription_id, taken_ns"
    insert(con, "message", names, [(stamp, subscription, 100 * SECOND) for stamp in stamps])


def test_a_publication_may_have_a_message_for_each_subscription(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """Also one that two share; but no second one for the same."""
    clock(rules)
    for n in range(10):
        time = n * PERIOD
        publish(rules, n, time, time + MILLISECOND)
        take_alone(rules, 5, time + 10_000)
        take_alone(rules, 6, time + 10_000)
        take_alone(rules, 7, time + 200_000)
    take_alone(rules, 7, 900_000)
    found = nearest(rules)
    assert {found[n * PERIOD + 10_000] for n in range(10)} == {(n, 1) for n in range(10)}
    assert [found[n * PERIOD + 200_000] for n in range(1, 10)] == [(n, 1) for n in range(1, 10)]
    assert found[200_000] == (0, 1)
    assert 900_000 not in found


def test_what_one_subscription_has_is_no_rival_for_another(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """Two writes go on; which of them the first message of 5 is of shows by its second."""
    clock(rules)
    time = periodic(rules, [10_000] * 10, MILLISECOND)
    rules.execute("UPDATE message SET only_subscription_id = 5")
    publish(rules, 998, time, time + 900_000)
    publish(rules, 999, time + 100_000, time + 500_000, publisher=2)
    take_alone(rules, 5, time + 50_000, time + 200_000)
    take_alone(rules, 6, time + 300_000)
    found = nearest(rules)
    assert (found[time + 50_000], found[time + 200_000]) == ((998, 1), (999, 1))
    assert found[time + 300_000] == (None, 2)


@pytest.mark.parametrize("second", [5, 6])
def test_a_stamp_that_two_subscriptions_share_is_of_one_publication(
    rules: duckdb.DuckDBPyConnection, second: int
) -> None:
    """For one of them it could only be this, for the other also that: nothing is told."""
    clock(rules)
    time = periodic(rules, [10_000] * 10, MILLISECOND)
    rules.execute("UPDATE message SET only_subscription_id = 5")
    publish(rules, 998, time, time + 900_000)
    publish(rules, 999, time + 100_000, time + 500_000, publisher=2)
    take_alone(rules, 5, time + 50_000, time + 200_000)
    if second != 5:
        take_alone(rules, second, time + 200_000)
    assert nearest(rules)[time + 200_000] == ((999, 1) if second == 5 else (None, 2))


@pytest.mark.parametrize(("delay", "is_rival"), [(500_000, True), (500_001, False)])
def test_two_messages_of_one_publication(
    rules: duckdb.DuckDBPyConnection, delay: int, *, is_rival: bool
) -> None:
    """The first is its own, unless the second could be as well; a third is never."""
    clock(rules)
    time = periodic(rules, [500_000] * 10, MILLISECOND)
    publish(rules, 999, time, time + MILLISECOND)
    take(rules, time + 400_000, time + delay, time + delay + 1)
    found = nearest(rules)
    assert found[time + 400_000] == (None if is_rival else 999, 1)
    assert found.get(time + delay) == ((None, 1) if is_rival else None)
    assert time + delay + 1 not in found


def test_a_message_that_may_be_of_another_publication_is_no_rival(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """Two messages may both be of the first. So the third, which comes later, is of the other."""
    clock(rules)
    time = periodic(rules, [500_000] * 10, MILLISECOND)
    publish(rules, 998, time, time + MILLISECOND)
    publish(rules, 999, time + 100_000, time + MILLISECOND, publisher=2)
    take(rules, time + 20_000, time + 50_000, time + 200_000)
    found = nearest(rules)
    assert found[time + 20_000] == found[time + 50_000] == (None, 1)
    assert found[time + 200_000] == (999, 1)


@pytest.mark.parametrize(("matched", "is_known"), [(5, True), (4, False)])
def test_a_difference_of_the_clocks_explains_half_of_a_topic(
    rules: duckdb.DuckDBPyConnection, matched: int, *, is_known: bool
) -> None:
    """The others are said to have none."""
    clock(rules)
    periodic(rules, [MICROSECOND] * matched + [50 * MILLISECOND] * (10 - matched), MILLISECOND)
    found = nearest(rules)
    assert found[MICROSECOND] == (0 if is_known else None, 1)
    assert (9 * PERIOD + 50 * MILLISECOND in found) is not is_known


@pytest.mark.parametrize(("count", "is_known"), [(8, True), (7, False)])
def test_of_topics_with_a_quorum_of_messages(
    rules: duckdb.DuckDBPyConnection, count: int, *, is_known: bool
) -> None:
    clock(rules)
    periodic(rules, [MICROSECOND] * count, MILLISECOND)
    publish(rules, 999, 0, MILLISECOND, "/b")
    take(rules, *range(2 * MILLISECOND, 2 * MILLISECOND + 20), topic="/b")
    assert nearest(rules)[MICROSECOND] == (0 if is_known else None, 1)


@pytest.mark.parametrize(("matched", "is_known"), [(3, True), (2, False)])
def test_or_half_of_all_messages(
    rules: duckdb.DuckDBPyConnection, matched: int, *, is_known: bool
) -> None:
    clock(rules)
    periodic(rules, [MICROSECOND] * matched + [50 * MILLISECOND] * (6 - matched), MILLISECOND)
    assert nearest(rules)[MICROSECOND] == (0 if is_known else None, 1)


@pytest.mark.parametrize(("late", "is_found"), [(29_999, True), (30_001, False)])
def test_beside_strangers_a_message_comes_no_later_than_thrice_what_half_of_them_take(
    rules: duckdb.DuckDBPyConnection, late: int, *, is_found: bool
) -> None:
    clock(rules)
    periodic(rules, [10_000] * 9 + [late], 50_000)
    take(rules, PERIOD // 2)
    assert (nearest(rules).get(9 * PERIOD + late) == (9, 1)) == is_found


@pytest.mark.parametrize(("soon", "is_found"), [(2_999, False), (3_000, True)])
def test_beside_strangers_a_message_comes_no_sooner_than_a_third_of_what_nearly_all_take(
    rules: duckdb.DuckDBPyConnection, soon: int, *, is_found: bool
) -> None:
    """One of two hundred comes sooner than the others, so soon that it may be of a stranger."""
    clock(rules)
    periodic(rules, [9_000] * 199 + [soon], 50_000)
    take(rules, PERIOD // 2)
    assert (nearest(rules).get(199 * PERIOD + soon) == (199, 1)) == is_found


def test_what_lost_events_leave_is_of_no_stranger(rules: duckdb.DuckDBPyConnection) -> None:
    clock(rules)
    periodic(rules, [10_000] * 9 + [40_000], 50_000)
    take(rules, PERIOD // 2)
    insert(rules, "derive.recording_gap", "start_ns, covered_until_ns", [(0, 1)])
    assert nearest(rules)[9 * PERIOD + 40_000] == (9, 1)


@pytest.mark.parametrize(("second", "is_first"), [(10_000, False), (10_001, True)])
def test_a_publication_has_the_first_message_unless_another_comes_as_soon(
    rules: duckdb.DuckDBPyConnection, second: int, *, is_first: bool
) -> None:
    clock(rules)
    periodic(rules, [10_000] * 9 + [5_000], 50_000)
    take(rules, 9 * PERIOD + second)
    found = nearest(rules)
    assert found[9 * PERIOD + 5_000] == ((9, 1) if is_first else (None, 1))
    assert found.get(9 * PERIOD + second) == (None if is_first else (None, 1))


@pytest.mark.parametrize(("slack", "count"), [(0, 1), (4_000, 1), (4_001, 2)])
def test_what_is_within_the_slack_of_the_clocks_comes_into_question(
    rules: duckdb.DuckDBPyConnection, slack: int, count: int
) -> None:
    clock(rules, slack=slack)
    publish(rules, 1, 0, 10_000)
    publish(rules, 2, 10_000, 100_000)
    take(rules, 14_000)
    assert nearest(rules) == {14_000: (2 if count == 1 else None, count)}


@pytest.mark.parametrize("stamp", [9_999, 20_000])
def test_but_has_no_message_that_missed_it(rules: duckdb.DuckDBPyConnection, stamp: int) -> None:
    clock(rules, slack=1_000)
    publish(rules, 1, 10_000, 20_000)
    take(rules, stamp)
    assert nearest(rules) == {stamp: (None, 1)}


@pytest.mark.parametrize(
    ("stamp", "found"),
    [
        (3 * SECOND + 5_000, (3, 1)),
        (3 * SECOND + 5_001, (None, None)),
        (6 * SECOND - 1, (None, None)),
        (6 * SECOND, (6, 1)),
    ],
)
def test_while_a_clock_is_set_nothing_is_told(
    rules: duckdb.DuckDBPyConnection, stamp: int, found: tuple[int | None, int | None]
) -> None:
    clock(rules, (0, None, 3 * SECOND + 5_000), (20_000, 6 * SECOND, None))
    for n in range(10):
        publish(rules, n, n * SECOND - 20_000 * (n > 3), n * SECOND + 10_000 - 20_000 * (n > 3))
    take(rules, *(n * SECOND + 4_000 for n in range(3)), stamp)
    assert nearest(rules)[stamp] == found


def test_a_clock_that_is_not_known_was_not_set(rules: duckdb.DuckDBPyConnection) -> None:
    rules.execute("INSERT INTO store.stamp_clock (clock_id) VALUES (2)")
    publish(rules, 1, 0, 10_000)
    take(rules, 5_000)
    assert nearest(rules) == {5_000: (None, 0)}


@pytest.mark.parametrize(("delay", "is_found"), [(20, True), (-20, False)])
def test_the_difference_drifts(
    rules: duckdb.DuckDBPyConnection, delay: int, *, is_found: bool
) -> None:
    """A second before and behind the moment of the difference, at 100 ppm."""
    rules.execute(
        "INSERT INTO store.stamp_clock (at_ns, difference_ns, drift_ppb) VALUES (?, 7000, 100000)",
        [SECOND],
    )
    publish(rules, 1, 0, 10_000)
    publish(rules, 2, 2 * SECOND, 2 * SECOND + 10_000)
    stamps = {1: 7_000 - 100_000 + delay, 2: 2 * SECOND + 7_000 + 100_000 + delay}
    take(rules, *stamps.values())
    found = {publication for publication, _ in nearest(rules).values()}
    assert (found == {1, 2}) == is_found
