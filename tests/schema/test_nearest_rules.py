"""Which publication a message is of, where the clocks are known: each rule from both sides."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import duckdb
import pytest
from support.rules import insert
from support.thorough import few

MICROSECOND = 1_000
MILLISECOND = 1_000_000
SECOND = 1_000_000_000
PERIOD = 100 * MILLISECOND

Row = tuple[int, int | None, int | None]


def clock(con: duckdb.DuckDBPyConnection, *differences: tuple[int, int, int]) -> None:
    """(difference, messages that agree, segment) of stretches of a second."""
    con.executemany(
        "INSERT INTO store.stamp_clock (at_ns, start_ns, end_ns, difference_ns, message_count, "
        "segment) VALUES (?, ?, ?, ?, ?, ?)",
        [
            (n * SECOND + SECOND // 2, n * SECOND, (n + 1) * SECOND, *difference)
            for n, difference in enumerate(differences)
        ],
    )


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
    names = "publication_id, written_ns, next_event_ns, topic_name, publisher_id, thread_id"
    row = (identity, written, closes, topic, publisher or ord(topic[1]), thread)
    insert(con, "published", names, [row])


def of_another_host(con: duckdb.DuckDBPyConnection, topic: str) -> None:
    """Let a topic be published where another clock counts, which does the same."""
    con.execute("UPDATE published SET clock_id = 2 WHERE topic_name = ?", [topic])
    con.execute(
        "INSERT INTO store.stamp_clock SELECT * REPLACE (2 AS clock_id) FROM store.stamp_clock"
    )


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
        "publication_id, written_ns, next_event_ns, topic_name, publisher_id",
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
    clock(rules, (0, 100, 0))
    publish(rules, 1, 100_000, 150_000)
    publish(rules, 2, 200_000, 250_000)
    publish(rules, 3, 300_000, 350_000)
    take(rules, stamp, taken=taken)
    take(rules, 210_000, 310_000)
    expected = {210_000: (2, 1), 310_000: (3, 1)}
    assert nearest(rules) == expected | ({stamp: (1, 1)} if is_found else {})


def close_pair(con: duckdb.DuckDBPyConnection, at: int, closed_for: int) -> int:
    """Publish twice, the second time at `at`, and take one message; returns its stamp.

    The stamp comes 1.3 µs after the second write began, and `closed_for` after the first one ended.
    """
    stamp = at + 1_300
    publish(con, at, stamp - closed_for - 2_300, stamp - closed_for)
    publish(con, at + 1, at, at + 50_000)
    take(con, stamp)
    return stamp


@pytest.mark.parametrize("others", [1, 110])
@pytest.mark.parametrize(
    ("closed_for", "is_told"),
    [
        pytest.param(1_700, False, id="as_at_the_start_of_a_container"),
        pytest.param(3_999, False, id="less_than_all_others_take"),
        pytest.param(4_000, True, id="more"),
    ],
)
def test_a_message_may_be_of_what_was_written_right_before(
    rules: duckdb.DuckDBPyConnection, others: int, closed_for: int, *, is_told: bool
) -> None:
    """All others come 4 µs after their writes: the clocks may differ by as much more.

    The message would be of the first write then, if that was over for less than 4 µs.
    """
    clock(rules, (0, 1_000, 0))
    at = periodic(rules, [4_000] * others, 50_000)
    stamp = close_pair(rules, at, closed_for)
    assert nearest(rules)[stamp] == (at + 1 if is_told else None, 1)


@pytest.mark.parametrize(("closed_for", "is_told"), [(499_999, False), (500_000, True)])
def test_what_messages_take_is_told_by_those_that_follow_no_other_write(
    rules: duckdb.DuckDBPyConnection, closed_for: int, *, is_told: bool
) -> None:
    """A message comes 1.3 µs after its write, as the one in question: is it of this write?"""
    clock(rules, (0, 1_000, 0))
    at = periodic(rules, [4_000] * 20, 50_000)
    close_pair(rules, at, closed_for)
    stamp = close_pair(rules, at + PERIOD, 1_700)
    assert nearest(rules)[stamp] == (at + PERIOD + 1 if is_told else None, 1)


def test_a_burst_is_told_where_every_write_follows_another(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    clock(rules, (0, 1_000, 0))
    publish(rules, 0, 0, 1_000)
    stamps = range(2_500, 102_500, 2_000)
    for stamp in stamps:
        publish(rules, stamp, stamp - 500, stamp + 500)
        take(rules, stamp)
    assert nearest(rules) == {stamp: (stamp, 1) for stamp in stamps}


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
    clock(rules, (0, 100, 0))
    publish(rules, 1, 100_000, 150_000)
    for clock_id, taken in zip(clocks, (50_000, 160_000), strict=True):
        rules.execute(
            "INSERT INTO message (source_timestamp_ns, clock_id, taken_ns) VALUES (120000, ?, ?)",
            [clock_id, taken],
        )
    assert nearest(rules) == {120_000: (1, 1) if is_found else (None, 0)}


def test_bursts_are_told_where_nothing_is_said_of_the_drift(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    clock(rules, (0, 100, 0))
    rules.execute("UPDATE store.stamp_clock SET is_sharp = NULL")
    publish(rules, 1, 0, MICROSECOND)
    publish(rules, 2, MICROSECOND, 2 * MICROSECOND)
    take(rules, 1, MICROSECOND + 1)
    assert nearest(rules) == {1: (1, 1), MICROSECOND + 1: (2, 1)}


def test_a_publication_alone_is_told_also_where_no_drift_is_known(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    clock(rules, (0, 100, 0))
    rules.execute("UPDATE store.stamp_clock SET is_sharp = false")
    publish(rules, 1, 0, MICROSECOND)
    take(rules, 1)
    assert nearest(rules) == {1: (1, 1)}


@pytest.mark.parametrize(("delay", "is_found"), [(5_000_000, True), (5_000_001, False)])
def test_a_thread_that_is_not_seen_to_go_on_writes_for_five_milliseconds(
    rules: duckdb.DuckDBPyConnection, delay: int, *, is_found: bool
) -> None:
    clock(rules, (0, 100, 0))
    publish(rules, 1, 0, None)
    take(rules, delay)
    assert nearest(rules)[delay] == ((1, 1) if is_found else (None, 0))


@pytest.mark.parametrize(("delay", "is_found"), [(396_000, True), (396_001, False)])
def test_or_for_twice_what_is_usual_for_it(
    rules: duckdb.DuckDBPyConnection, delay: int, *, is_found: bool
) -> None:
    """99 of 100 delays are at most 198 µs."""
    clock(rules, (0, 100, 0))
    time = periodic(rules, (n * MICROSECOND for n in range(1, 201)), MILLISECOND)
    publish(rules, 999, time, None)
    take(rules, time + delay)
    assert nearest(rules).get(time + delay) == ((999, 1) if is_found else None)


@pytest.mark.parametrize(
    ("next_event", "delay", "is_found"),
    [
        pytest.param(900_000, 396_000, True, id="usual"),
        pytest.param(900_000, 396_001, False, id="unusual"),
        pytest.param(300_000, 299_999, True, id="before_it_is_seen_again"),
        pytest.param(300_000, 300_000, False, id="behind"),
    ],
)
def test_who_is_seen_again_behind_a_gap_may_have_gone_on_before(
    rules: duckdb.DuckDBPyConnection, next_event: int, delay: int, *, is_found: bool
) -> None:
    """What was written behind a gap bounds the search, and is no example of what is usual."""
    clock(rules, (0, 100, 0))
    time = periodic(rules, (n * MICROSECOND for n in range(1, 201)), MILLISECOND)
    time = periodic(rules, [MILLISECOND - 1] * 10, MILLISECOND, since=time)
    publish(rules, 999, time, time + next_event)
    rules.execute("UPDATE published SET has_break = true WHERE publication_id >= 200")
    take(rules, time + delay)
    assert nearest(rules).get(time + delay) == ((999, 1) if is_found else None)


@pytest.mark.parametrize(("delay", "is_found"), [(396_000, True), (396_001, False)])
def test_or_for_twice_what_is_usual_on_its_host(
    rules: duckdb.DuckDBPyConnection, delay: int, *, is_found: bool
) -> None:
    """Its own thread was never seen to go on; those of another topic's publisher were.

    A publication counts once. On another host other delays are usual.
    """
    clock(rules, (0, 100, 0))
    usual = (n * MICROSECOND for n in range(1, 201))
    time = periodic(rules, usual, MILLISECOND, topic="/b")
    take(rules, *(n * PERIOD + 900_000 for n in range(0, 200, 10)), topic="/b")
    periodic(rules, [800_000] * 20, MILLISECOND, topic="/c", first=500)
    of_another_host(rules, "/c")
    publish(rules, 999, time, None)
    take(rules, time + delay)
    found = nearest(rules)
    assert found.get(time + delay, (None, 0))[0] == (999 if is_found else None)


@pytest.mark.parametrize(
    ("own", "delay", "is_found"),
    [
        pytest.param(99, 396_000, True, id="usual_on_the_host"),
        pytest.param(99, 396_001, False, id="unusual_on_the_host"),
        pytest.param(100, 2_000, True, id="usual_for_it"),
        pytest.param(100, 2_001, False, id="unusual_for_it"),
    ],
)
def test_a_hundred_messages_tell_what_is_usual_for_a_publisher(
    rules: duckdb.DuckDBPyConnection, own: int, delay: int, *, is_found: bool
) -> None:
    """Where it has fewer, its host tells, if that needs longer."""
    clock(rules, (0, 100, 0))
    time = periodic(rules, [MICROSECOND] * own, MILLISECOND)
    usual = (n * MICROSECOND for n in range(1, 201))
    time = periodic(rules, usual, MILLISECOND, since=time, topic="/b")
    publish(rules, 999, time, None)
    take(rules, time + delay)
    found = nearest(rules)
    assert found.get(time + delay, (None, 0))[0] == (999 if is_found else None)


@pytest.mark.parametrize(
    ("median", "width", "delay", "is_found"),
    [
        pytest.param(1, 44, 16.0, True, id="writes_for_less_than_half"),
        pytest.param(1, 46, 16.0, False, id="writes_for_more"),
        pytest.param(1, 46, 5.0, True, id="five_milliseconds"),
        pytest.param(1, 46, 5.1, False, id="longer"),
        pytest.param(3, 46, 12.0, True, id="four_medians"),
        pytest.param(3, 46, 12.1, False, id="more"),
    ],
)
def test_who_writes_for_much_of_the_time_has_messages_of_others_within(
    rules: duckdb.DuckDBPyConnection, median: int, width: int, delay: float, *, is_found: bool
) -> None:
    """Times in milliseconds of a period of 100."""
    clock(rules, (0, 100, 0))
    late = round(delay * MILLISECOND)
    periodic(rules, [median * MILLISECOND] * 9 + [late], width * MILLISECOND)
    assert nearest(rules)[9 * PERIOD + late] == (9 if is_found else None, 1)


def test_how_much_of_the_time_each_publisher_writes(rules: duckdb.DuckDBPyConnection) -> None:
    """Half a period or a sixth; both have a message 16 ms after the write."""
    clock(rules, (0, 100, 0))
    late = 16 * MILLISECOND
    for topic, width in (("/a", 50), ("/b", 17)):
        for n in range(10):
            written = n * PERIOD + (topic == "/b") * 200_000
            publish(rules, 100 * ord(topic[1]) + n, written, written + width * MILLISECOND, topic)
            take(rules, written + (late if n == 9 else MILLISECOND), topic=topic)
    found = nearest(rules)
    assert found[9 * PERIOD + late] == (None, 1)
    assert found[9 * PERIOD + late + 200_000] == (100 * ord("b") + 9, 1)


@pytest.mark.parametrize("second", ["thread", "publisher"])
def test_all_writes_that_go_on_come_into_question(
    rules: duckdb.DuckDBPyConnection, second: str
) -> None:
    """Of threads that share a publisher, and of publishers; also an earlier one."""
    clock(rules, (0, 100, 0))
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
    clock(rules, (0, 100, 0))
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
    clock(rules, (0, 100, 0))
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


def test_what_is_usual_counts_each_subscription(rules: duckdb.DuckDBPyConnection) -> None:
    """The second channel is written later than the first."""
    clock(rules, (0, 100, 0))
    for n in range(10):
        publish(rules, n, n * PERIOD, n * PERIOD + MILLISECOND)
        take_alone(rules, 5, n * PERIOD + 10_000)
        take_alone(rules, 6, n * PERIOD + 200_000)
    publish(rules, 999, SECOND, None)
    take_alone(rules, 6, SECOND + 400_000)
    assert nearest(rules)[SECOND + 400_000] == (999, 1)


def test_what_one_subscription_has_is_no_rival_for_another(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """Two writes go on; which of them the first message of 5 is of shows by its second."""
    clock(rules, (0, 100, 0))
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
    clock(rules, (0, 100, 0))
    time = periodic(rules, [10_000] * 10, MILLISECOND)
    rules.execute("UPDATE message SET only_subscription_id = 5")
    publish(rules, 998, time, time + 900_000)
    publish(rules, 999, time + 100_000, time + 500_000, publisher=2)
    take_alone(rules, 5, time + 50_000, time + 200_000)
    if second != 5:
        take_alone(rules, second, time + 200_000)
    assert nearest(rules)[time + 200_000] == ((999, 1) if second == 5 else (None, 2))


@pytest.mark.parametrize(("missed", "is_found"), [(False, True), (True, False)])
def test_a_stranger_takes_the_place_of_what_one_subscription_missed(
    rules: duckdb.DuckDBPyConnection, *, missed: bool, is_found: bool
) -> None:
    beside_strangers(rules, taken=20)
    rules.execute("UPDATE message SET only_subscription_id = 5")
    take_alone(rules, 6, *(n * PERIOD + 20_000 for n in range(20) if n or not missed))
    assert nearest(rules)[UNUSUAL] == (9 if is_found else None, 1)


def test_unless_that_comes_later_than_is_usual(rules: duckdb.DuckDBPyConnection) -> None:
    """The publisher writes for most of the time, so that it may be of somebody else."""
    clock(rules, (0, 100, 0))
    time = periodic(rules, [MILLISECOND] * 20, 60 * MILLISECOND)
    publish(rules, 998, time, time + 60 * MILLISECOND)
    publish(rules, 999, time + 100_000, time + 500_000, publisher=2)
    take(rules, time + 200_000, time + 5_100_000)
    found = nearest(rules)
    assert found[time + 200_000] == (None, 2)
    assert found[time + 5_100_000] == (None, 1)


def beside_strangers(
    con: duckdb.DuckDBPyConnection,
    *,
    stranger: int | None = 50 * MILLISECOND,
    taken: int = 19,
    others: Iterable[int] = (),
) -> None:
    """Twenty writes of 10 ms; 19 or 20 have a message, 10 µs after each but one: 100 µs."""
    clock(con, (0, 100, 0), (0, 100, 0), (0, 100, 0))
    for n in range(20):
        publish(con, n, n * PERIOD, n * PERIOD + 10 * MILLISECOND)
        if n < taken:
            take(con, n * PERIOD + (100_000 if n == 9 else 10_000))
    if stranger is not None:
        take(con, stranger)
    for n, delay in enumerate(others):
        publish(con, 100 + n, n * MILLISECOND, n * MILLISECOND + 500_000, "/b")
        take(con, n * MILLISECOND + delay, topic="/b")


UNUSUAL = 9 * PERIOD + 100_000


@pytest.mark.parametrize(
    ("system", "is_found"),
    [
        pytest.param({}, False, id="it_may_be_theirs"),
        pytest.param({"stranger": None}, True, id="nobody_else_publishes"),
        pytest.param({"stranger": -1}, True, id="nobody_else_while_it_was_recorded"),
        pytest.param({"stranger": 19 * PERIOD + 50 * MILLISECOND}, True, id="nor_behind"),
        pytest.param({"taken": 20}, True, id="each_publication_has_one"),
        pytest.param({"others": [100_000] * 100}, True, id="usual_without_other_publishers"),
        pytest.param({"others": [99_999] * 100}, False, id="longer_than_is_usual_there"),
        pytest.param({"others": [30_000] * 99}, True, id="too_few_to_say_what_is_usual_there"),
    ],
)
def test_a_message_of_somebody_else_may_take_the_place_of_one_that_nobody_took(
    rules: duckdb.DuckDBPyConnection, system: dict[str, Any], *, is_found: bool
) -> None:
    """Where another one came while nobody wrote, a publication has what comes as soon as usual."""
    beside_strangers(rules, **system)
    found = nearest(rules)
    assert found[10_000] == (0, 1)
    assert found[UNUSUAL] == (9 if is_found else None, 1)


@pytest.mark.parametrize(
    ("delay", "stranger", "is_found"),
    [(8_000, True, True), (7_999, True, False), (7_999, False, True)],
)
def test_a_message_of_somebody_else_comes_sooner_than_is_usual(
    rules: duckdb.DuckDBPyConnection, delay: int, *, stranger: bool, is_found: bool
) -> None:
    """Nearly all take 10 µs or more, and half of them 11 µs."""
    beside_strangers(rules, stranger=50 * MILLISECOND if stranger else None)
    rules.execute(
        "UPDATE message SET source_timestamp_ns = CASE source_timestamp_ns // $period "
        "WHEN 9 THEN 9 * $period + $delay "
        "ELSE source_timestamp_ns + 1000 * (source_timestamp_ns // $period % 4) END "
        "WHERE source_timestamp_ns % $period <= 100000",
        {"delay": delay, "period": PERIOD},
    )
    assert nearest(rules)[9 * PERIOD + delay] == (9 if is_found else None, 1)


def test_another_topic_has_its_own_strangers(rules: duckdb.DuckDBPyConnection) -> None:
    """It has none: one message came before its publications began. Some stamps are the same."""
    beside_strangers(rules)
    begin = 50 * MILLISECOND - 10_000
    for n in range(20):
        written = begin + n * PERIOD
        publish(rules, 100 + n, written, written + 10 * MILLISECOND, "/b")
        if n < 19:
            take(rules, written + (100_000 if n == 9 else 10_000), topic="/b")
    take(rules, 20 * MILLISECOND, topic="/b")
    found = nearest(rules)
    assert found[UNUSUAL] == (None, 1)
    assert found[begin + UNUSUAL] == (109, 1)


def test_beside_strangers_nothing_is_told_if_nothing_is_usual(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    beside_strangers(rules)
    rules.execute("UPDATE published SET has_break = true")
    assert {publication for publication, _ in nearest(rules).values()} == {None}


@pytest.mark.parametrize(("delay", "is_found"), [(25_000, True), (24_999, False)])
def test_else_four_times_what_half_of_them_take(
    rules: duckdb.DuckDBPyConnection, delay: int, *, is_found: bool
) -> None:
    beside_strangers(rules)
    rules.execute(
        "UPDATE message SET source_timestamp_ns = source_timestamp_ns + $delay - 10000 "
        "WHERE source_timestamp_ns % 100000000 = 10000",
        {"delay": delay},
    )
    assert nearest(rules)[UNUSUAL] == (9 if is_found else None, 1)


def test_a_message_whose_publication_is_lost_is_of_nobody_else(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    beside_strangers(rules)
    lose(rules, 40 * MILLISECOND, 60 * MILLISECOND)
    assert nearest(rules)[UNUSUAL] == (9, 1)


@pytest.mark.parametrize(("delay", "is_rival"), [(500_000, True), (500_001, False)])
def test_two_messages_of_one_publication(
    rules: duckdb.DuckDBPyConnection, delay: int, *, is_rival: bool
) -> None:
    """The first is its own, unless the second could be as well; a third is never."""
    clock(rules, (0, 100, 0))
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
    clock(rules, (0, 100, 0))
    time = periodic(rules, [500_000] * 10, MILLISECOND)
    publish(rules, 998, time, time + MILLISECOND)
    publish(rules, 999, time + 100_000, time + MILLISECOND, publisher=2)
    take(rules, time + 20_000, time + 50_000, time + 200_000)
    found = nearest(rules)
    assert found[time + 20_000] == found[time + 50_000] == (None, 1)
    assert found[time + 200_000] == (999, 1)


def lose(con: duckdb.DuckDBPyConnection, start: int, end: int) -> None:
    con.execute(
        "INSERT INTO derive.recording_gap (start_ns, covered_until_ns) VALUES (?, ?)", [start, end]
    )


@pytest.mark.parametrize("topic", few(["/a", "/b"], "/a"))
@pytest.mark.parametrize(("delay", "is_told"), [(5_000, True), (4_999, False)])
def test_what_is_stamped_much_sooner_than_usual_may_be_of_a_lost_publication(
    rules: duckdb.DuckDBPyConnection, delay: int, topic: str, *, is_told: bool
) -> None:
    """1 of 100 delays is shorter than 10 µs. Where nothing is lost, there is no other."""
    clock(rules, (0, 100, 0))
    time = periodic(rules, [5_500] + [10_000] * 199, MILLISECOND)
    publish(rules, 999, time, time + MILLISECOND, topic)
    take(rules, time + delay, topic=topic)
    assert nearest(rules)[time + delay] == (999, 1)
    lose(rules, time - 1, time)
    assert nearest(rules)[time + delay] == (999 if is_told else None, 1)


@pytest.mark.parametrize(("delay", "is_told"), [(500_000, True), (499_999, False)])
def test_what_is_usual_for_small_messages_is_too_soon_for_a_large_one(
    rules: duckdb.DuckDBPyConnection, delay: int, *, is_told: bool
) -> None:
    clock(rules, (0, 100, 0))
    time = periodic(rules, [MILLISECOND] * 200, 2 * MILLISECOND)
    since = 10 * MILLISECOND
    periodic(rules, [1_000] * 200, MILLISECOND, since=since, topic="/b", first=1_000)
    publish(rules, 999, time, time + 2 * MILLISECOND)
    take(rules, time + delay)
    lose(rules, time - 1, time)
    assert nearest(rules)[time + delay] == (999 if is_told else None, 1)


@pytest.mark.parametrize("has_rival", [True, False])
def test_messages_of_another_writer_do_not_make_a_publisher_fast(
    rules: duckdb.DuckDBPyConnection, *, has_rival: bool
) -> None:
    """Ten messages come 10 µs behind a write. If another publisher writes, too, they may be its."""
    clock(rules, (0, 100, 0))
    time = periodic(rules, [MILLISECOND] * 200, 2 * MILLISECOND)
    for moment in range(0, time, 20 * PERIOD):
        if has_rival:
            publish(rules, 1000 + moment // PERIOD, moment - 20_000, moment + 15_000, publisher=2)
        take(rules, moment + 10_000)
    publish(rules, 999, time, time + 2 * MILLISECOND)
    take(rules, time + 400_000)
    lose(rules, time - 1, time)
    assert nearest(rules)[time + 400_000] == (None if has_rival else 999, 1)


def test_nothing_is_too_soon_where_nothing_is_usual(rules: duckdb.DuckDBPyConnection) -> None:
    clock(rules, (0, 100, 0))
    publish(rules, 1, 0, None)
    take(rules, MICROSECOND)
    lose(rules, -1, 0)
    assert nearest(rules) == {MICROSECOND: (1, 1)}


@pytest.mark.parametrize(
    ("start", "end", "next_event", "is_told"),
    [
        pytest.param(-9, -1, MILLISECOND, True, id="before"),
        pytest.param(-9, 0, MILLISECOND, False, id="as_it_begins"),
        pytest.param(MILLISECOND, 9 * MILLISECOND, MILLISECOND, False, id="as_the_thread_goes_on"),
        pytest.param(MILLISECOND + 1, 9 * MILLISECOND, MILLISECOND, True, id="behind"),
        pytest.param(5 * MILLISECOND, 9 * MILLISECOND, None, False, id="while_it_may_write"),
        pytest.param(5 * MILLISECOND + 1, 9 * MILLISECOND, None, True, id="once_it_is_written"),
    ],
)
def test_if_there_is_a_gap_beside_it(
    rules: duckdb.DuckDBPyConnection,
    start: int,
    end: int,
    next_event: int | None,
    *,
    is_told: bool,
) -> None:
    clock(rules, (0, 100, 0))
    time = periodic(rules, [10_000] * 200, MILLISECOND)
    publish(rules, 999, time, None if next_event is None else time + next_event)
    take(rules, time + 1_000)
    lose(rules, time + start, time + end)
    assert nearest(rules)[time + 1_000] == (999 if is_told else None, 1)


@pytest.mark.parametrize(("matched", "is_known"), [(5, True), (4, False)])
def test_a_difference_of_the_clocks_explains_half_of_a_topic(
    rules: duckdb.DuckDBPyConnection, matched: int, *, is_known: bool
) -> None:
    """The others are said to have none."""
    clock(rules, (0, 100, 0))
    periodic(rules, [MICROSECOND] * matched + [50 * MILLISECOND] * (10 - matched), MILLISECOND)
    found = nearest(rules)
    assert found[MICROSECOND] == (0 if is_known else None, 1)
    assert (9 * PERIOD + 50 * MILLISECOND in found) is not is_known


@pytest.mark.parametrize(("count", "is_known"), [(8, True), (7, False)])
def test_of_topics_with_a_quorum_of_messages(
    rules: duckdb.DuckDBPyConnection, count: int, *, is_known: bool
) -> None:
    clock(rules, (0, 100, 0))
    periodic(rules, [MICROSECOND] * count, MILLISECOND)
    publish(rules, 999, 0, MILLISECOND, "/b")
    take(rules, *range(2 * MILLISECOND, 2 * MILLISECOND + 20), topic="/b")
    assert nearest(rules)[MICROSECOND] == (0 if is_known else None, 1)


@pytest.mark.parametrize(("matched", "is_known"), [(3, True), (2, False)])
def test_or_half_of_all_messages(
    rules: duckdb.DuckDBPyConnection, matched: int, *, is_known: bool
) -> None:
    clock(rules, (0, 100, 0))
    periodic(rules, [MICROSECOND] * matched + [50 * MILLISECOND] * (6 - matched), MILLISECOND)
    assert nearest(rules)[MICROSECOND] == (0 if is_known else None, 1)


def test_where_the_clocks_are_not_known_nothing_is_told(rules: duckdb.DuckDBPyConnection) -> None:
    """Nor in the stretch before: in its last part, the clock may have been set already."""
    clock(rules, (0, 100, 0), (0, 100, 0), (0, 0, 0))
    publish(rules, 1, 0, MILLISECOND)
    publish(rules, 2, SECOND, SECOND + MILLISECOND)
    publish(rules, 3, -SECOND, MILLISECOND - SECOND)
    publish(rules, 4, 2 * SECOND, 2 * SECOND + MILLISECOND)
    for stamp in (n * SECOND + MICROSECOND for n in (-1, 0, 1, 2)):
        take(rules, stamp, taken=stamp + MILLISECOND)
    assert nearest(rules) == {
        MICROSECOND - SECOND: (3, 1),
        MICROSECOND: (1, 1),
        SECOND + MICROSECOND: (None, 0),
        2 * SECOND + MICROSECOND: (None, 0),
    }


@pytest.mark.parametrize(
    ("unknown", "segment", "messages", "is_found"),
    [(1, 0, 100, True), (2, 0, 100, False), (1, 1, 100, False), (1, 0, 0, False)],
)
def test_a_clock_goes_on_where_one_stretch_alone_tells_nothing(
    rules: duckdb.DuckDBPyConnection, unknown: int, segment: int, messages: int, *, is_found: bool
) -> None:
    """Half way between the differences on both sides, if it did not jump meanwhile.

    Else what is before such a stretch is not known either.
    """
    clock(rules, (0, 100, 0), *[(7 * SECOND, 0, 0)] * unknown, (200_000, messages, segment))
    written = SECOND + SECOND // 2
    publish(rules, 1, written, written + 50_000)
    stamp = written + 110_000
    take(rules, stamp)
    publish(rules, 2, SECOND // 2, SECOND // 2 + 50_000)
    take(rules, SECOND // 2 + 10_000)
    found = nearest(rules)
    assert (found[stamp] == (1, 1)) is is_found
    assert (found[SECOND // 2 + 10_000] == (2, 1)) is is_found


def test_and_drifts_as_on_both_sides(rules: duckdb.DuckDBPyConnection) -> None:
    clock(rules, (0, 100, 0), (0, 0, 0), (200_000, 100, 0))
    rules.execute(
        "UPDATE store.stamp_clock SET drift_ppb = 50000 + 50000 * (start_ns // ?)", [SECOND]
    )
    written = SECOND + SECOND // 10 * 9
    publish(rules, 1, written, written + 5_000)
    take(rules, written + 140_000)
    assert nearest(rules) == {written + 140_000: (1, 1)}


def test_nor_where_it_tells_nothing_before(rules: duckdb.DuckDBPyConnection) -> None:
    clock(rules, (0, 0, 0), (0, 0, 0), (0, 100, 0))
    publish(rules, 1, SECOND + SECOND // 2, 2 * SECOND)
    take(rules, SECOND + SECOND // 2 + 1)
    assert [publication for publication, _ in nearest(rules).values()] == [None]


def step_by(con: duckdb.DuckDBPyConnection, difference: int, clock_id: int = 1) -> None:
    """Three stretches on either side of a step: it is certain before 2 s and behind 4 s."""
    clock(con, *[(0, 100, 0)] * 3, *[(difference, 100, 1)] * 3)
    con.execute("UPDATE store.stamp_clock SET clock_id = ? WHERE clock_id = 1", [clock_id])


def stamped(
    con: duckdb.DuckDBPyConnection, written: int, difference: int, *, taken: int | None = None
) -> tuple[int | None, int | None] | None:
    """What is said of a message with this difference; it is taken 1 ms later or elsewhere."""
    publish(con, 1, written, written + 50_000)
    stamp = written + difference + MICROSECOND
    take(con, stamp, taken=taken or written + MILLISECOND)
    if taken == 0:
        con.execute("UPDATE message SET clock_id = 2")
    return nearest(con).get(stamp)


@pytest.mark.parametrize(
    "by", few([7_000, -7_000, 10 * MILLISECOND, 3_600 * SECOND, -3_600 * SECOND], 7_000)
)
@pytest.mark.parametrize("taken", [None, 0])
@pytest.mark.parametrize(
    ("written", "is_told"),
    [
        (SECOND // 10, True),
        (2 * SECOND - 20 * MILLISECOND, True),
        (2 * SECOND + 20 * MILLISECOND, False),
        (3 * SECOND - 20 * MILLISECOND, False),
        (3 * SECOND + 20 * MILLISECOND, False),
        (4 * SECOND - 20 * MILLISECOND, False),
        (4 * SECOND + 20 * MILLISECOND, True),
        (6 * SECOND - MILLISECOND, True),
    ],
)
def test_around_a_step_nothing_is_told(
    rules: duckdb.DuckDBPyConnection, written: int, taken: int | None, by: int, *, is_told: bool
) -> None:
    """However far the clock was set, and wherever the message was taken."""
    step_by(rules, by)
    found = stamped(rules, written, by if written > 3 * SECOND else 0, taken=taken)
    assert found == ((1, 1) if is_told else (None, None))


@pytest.mark.parametrize(
    ("written", "is_told"),
    [
        (SECOND // 4, True),
        # Stamped in a second that was there twice.
        (SECOND // 2, False),
        (2 * SECOND - 20 * MILLISECOND, False),
        (4 * SECOND + 20 * MILLISECOND, False),
        (5 * SECOND + SECOND // 4, False),
        (5 * SECOND + SECOND // 4 * 3, True),
    ],
)
def test_a_stamp_of_two_times_is_of_none(
    rules: duckdb.DuckDBPyConnection, written: int, *, is_told: bool
) -> None:
    """The clock was set back by more than the second before the step; another clock takes it."""
    back = -3 * SECOND // 2
    step_by(rules, back)
    found = stamped(rules, written, back if written > 3 * SECOND else 0, taken=0)
    assert found == ((1, 1) if is_told else (None, None))


@pytest.mark.parametrize("written", [SECOND // 2, 5 * SECOND + SECOND // 4])
def test_but_its_take_on_this_clock_tells_of_which(
    rules: duckdb.DuckDBPyConnection, written: int
) -> None:
    back = -3 * SECOND // 2
    step_by(rules, back)
    assert stamped(rules, written, back if written > 3 * SECOND else 0) == (1, 1)


@pytest.mark.parametrize(
    ("taken", "expected"),
    [(2 * SECOND - 1, (1, 1)), (2 * SECOND, (None, None)), (5 * SECOND, (None, None))],
)
def test_a_message_that_waited_while_a_clock_was_set_has_no_link(
    rules: duckdb.DuckDBPyConnection, taken: int, expected: tuple[int | None, int | None]
) -> None:
    """It may as well have been published later, with a stamp of the past."""
    step_by(rules, 40 * MILLISECOND)
    assert stamped(rules, SECOND, 0, taken=taken) == expected


def test_or_while_nothing_is_known_of_the_clock(rules: duckdb.DuckDBPyConnection) -> None:
    """In the stretch before that it may have been set already."""
    clock(rules, *[(0, 100, 0)] * 3, (0, 0, 0), (0, 0, 0))
    assert stamped(rules, SECOND, 0, taken=2 * SECOND) == (None, 0)


def test_a_message_may_be_of_a_host_whose_clock_was_set(rules: duckdb.DuckDBPyConnection) -> None:
    """Then the clock of another one does not tell."""
    clock(rules, *[(0, 100, 0)] * 6)
    rules.execute("UPDATE store.stamp_clock SET clock_id = 2")
    step_by(rules, 40 * MILLISECOND)
    publish(rules, 1, SECOND, SECOND + 50_000)
    publish(rules, 2, 3 * SECOND, 3 * SECOND + 50_000, publisher=2)
    publish(rules, 3, 5 * SECOND, 5 * SECOND + 50_000, publisher=2)
    rules.execute("UPDATE published SET clock_id = publisher_id WHERE publisher_id = 2")
    rules.execute("UPDATE published SET publisher_id = 1 WHERE publisher_id <> 2")
    take(rules, 3 * SECOND + 10, 5 * SECOND + 10)
    assert nearest(rules) == {3 * SECOND + 10: (None, None), 5 * SECOND + 10: (3, 1)}


@pytest.mark.parametrize("segment", [0, 1])
def test_all_messages_until_a_step_show_whether_a_difference_is_right(
    rules: duckdb.DuckDBPyConnection, segment: int
) -> None:
    """Behind it, the difference explains none."""
    clock(rules, *[(0, 100, 0)] * 3, *[(0, 100, segment)] * 3)
    periodic(rules, [10_000] * 5, MILLISECOND)
    publish(rules, 99, 6 * SECOND - PERIOD, 6 * SECOND - PERIOD + MILLISECOND)
    stranger = 6 * SECOND - PERIOD // 2
    take(rules, stranger)
    rules.execute("UPDATE message SET taken_ns = source_timestamp_ns + 1000000")
    found = nearest(rules)
    assert found[10_000] == (0, 1)
    assert found.get(stranger) == ((None, 0) if segment else None)


def test_an_unknown_side_of_a_jump_tells_nothing(rules: duckdb.DuckDBPyConnection) -> None:
    clock(rules, (0, 0, 0), (10 * MILLISECOND, 100, 1), (20 * MILLISECOND, 0, 2))
    publish(rules, 1, SECOND + MILLISECOND, SECOND + 2 * MILLISECOND)
    take(rules, SECOND + MILLISECOND + 1, SECOND + 21 * MILLISECOND + 1)
    assert nearest(rules) == {
        SECOND + MILLISECOND + 1: (None, 0),
        SECOND + 21 * MILLISECOND + 1: (None, 0),
    }


def test_before_the_first_stretch_a_clock_is_as_in_it(rules: duckdb.DuckDBPyConnection) -> None:
    """So nothing is known before one that tells nothing."""
    clock(rules, (0, 0, 0), (0, 100, 0), (0, 100, 0))
    publish(rules, 1, -SECOND, MILLISECOND - SECOND)
    take(rules, MICROSECOND - SECOND)
    assert nearest(rules) == {MICROSECOND - SECOND: (None, 0)}


@pytest.mark.parametrize("written", [SECOND // 2, SECOND + SECOND // 2])
def test_until_a_jump_the_difference_is_that_of_the_stretch(
    rules: duckdb.DuckDBPyConnection, written: int
) -> None:
    clock(rules, (0, 100, 0), (300_000, 100, 0))
    publish(rules, 1, written, written + 50_000)
    take(rules, written + 10, written + 300_010)
    assert list(nearest(rules)) == [written + 10 if written < SECOND else written + 300_010]


def test_each_host_has_its_own_clock(rules: duckdb.DuckDBPyConnection) -> None:
    """Of the second one it is not known; that of the third explains none of its messages."""
    clock(rules, (0, 100, 0), (0, 100, 0))
    for host, (topic, begin) in enumerate((("/a", 0), ("/b", 0), ("/c", 50 * MILLISECOND)), 1):
        for n in range(10):
            written = n * PERIOD + begin
            publish(rules, 100 * host + n, written, written + MILLISECOND, topic)
            take(rules, n * PERIOD + (20_000 if topic == "/b" else 10_000), topic=topic)
        rules.execute("UPDATE published SET clock_id = ? WHERE topic_name = ?", [host, topic])
    rules.execute(
        "INSERT INTO store.stamp_clock SELECT * REPLACE (3 AS clock_id) FROM store.stamp_clock "
        "UNION ALL SELECT * REPLACE (2 AS clock_id, 0 AS message_count) FROM store.stamp_clock"
    )
    rows = rules.execute(
        "SELECT topic_name, source_timestamp_ns // 100000000, publication_id "
        "FROM derive.nearest_message(1) ORDER BY ALL"
    ).fetchall()
    assert rows == [
        *(("/a", n, 100 + n) for n in range(10)),
        *(("/b", n, None) for n in range(10)),
        *(("/c", n, None) for n in range(10)),
    ]


def test_a_stretch_has_enough_messages_of_its_own_clock(rules: duckdb.DuckDBPyConnection) -> None:
    """Those of other hosts say nothing of it: 36 messages are three stretches, 24 are two."""
    periodic(rules, [10_000] * 36, MILLISECOND)
    periodic(rules, [10_000] * 24, MILLISECOND, since=20_000, topic="/b", first=100)
    rules.execute("UPDATE published SET clock_id = 2 WHERE topic_name = '/b'")
    rows = rules.execute(
        "SELECT DISTINCT clock_id, stretch_ns FROM derive.stamp_pair(1) ORDER BY 1"
    ).fetchall()
    assert rows == [(1, 1 + 35 * PERIOD // 3), (2, 1 + 23 * PERIOD // 2)]


def test_a_topic_that_two_hosts_publish(rules: duckdb.DuckDBPyConnection) -> None:
    """The clock of the second one explains hardly anything: what may be its own has no source."""
    clock(rules, (0, 100, 0), (0, 100, 0))
    periodic(rules, [10_000] * 10, MILLISECOND)
    publish(rules, 999, 50 * MILLISECOND, 51 * MILLISECOND, publisher=2)
    rules.execute("UPDATE published SET clock_id = publisher_id WHERE publisher_id = 2")
    rules.execute(
        "INSERT INTO store.stamp_clock SELECT * REPLACE (2 AS clock_id) FROM store.stamp_clock"
    )
    take(rules, 50 * MILLISECOND + 10_000, 70 * MILLISECOND)
    found = nearest(rules)
    assert found[10_000] == (0, 1)
    assert found[50 * MILLISECOND + 10_000] == (None, 1)
    assert found[70 * MILLISECOND] == (None, 0)


@pytest.mark.parametrize("seconds", [10, -10])
def test_the_difference_drifts_within_a_stretch(
    rules: duckdb.DuckDBPyConnection, seconds: int
) -> None:
    """200 ppm in 10 s are 2 ms."""
    rules.execute(
        "INSERT INTO store.stamp_clock (at_ns, start_ns, end_ns, drift_ppb) "
        "VALUES (?, ?, ?, 200000)",
        [20 * SECOND, 0, 40 * SECOND],
    )
    written = (20 + seconds) * SECOND
    publish(rules, 1, written, written + MICROSECOND)
    stamp = written + seconds // 5 * MILLISECOND
    take(rules, stamp)
    assert nearest(rules) == {stamp: (1, 1)}


@pytest.mark.parametrize(("apart", "is_told"), [(420, True), (380, False)])
@pytest.mark.parametrize("first", [1, 2])
def test_bursts_are_not_told_where_no_drift_is_known(
    rules: duckdb.DuckDBPyConnection, first: int, apart: int, *, is_told: bool
) -> None:
    """In a second, half a second from its middle, 200 ppm are 200 µs, earlier or later."""
    clock(rules, (0, 100, 0))
    rules.execute("UPDATE store.stamp_clock SET is_sharp = false")
    apart *= MICROSECOND
    publish(rules, first, 0, 10 * MICROSECOND)
    publish(rules, 3 - first, apart, apart + 10 * MICROSECOND)
    publish(rules, 9, SECOND // 2, SECOND // 2 + 10 * MICROSECOND)
    take(rules, 1, apart + 1)
    told = {1: (first, 1), apart + 1: (3 - first, 1)}
    assert nearest(rules) == (told if is_told else dict.fromkeys(told, (None, 1)))


@pytest.mark.parametrize(
    ("apart", "is_sharp", "is_told"),
    [(420, False, True), (380, False, False), (380, True, True)],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_nor_are_bursts_of_messages(
    rules: duckdb.DuckDBPyConnection, apart: int, sign: int, *, is_sharp: bool, is_told: bool
) -> None:
    """The other one is of somebody who is not traced."""
    clock(rules, (0, 100, 0))
    rules.execute("UPDATE store.stamp_clock SET is_sharp = ?", [is_sharp])
    publish(rules, 1, 0, 10 * MICROSECOND)
    publish(rules, 2, SECOND // 2, SECOND // 2 + 10 * MICROSECOND)
    stamp = 1 if sign > 0 else SECOND // 2 + 1
    other = stamp + apart * MICROSECOND // (1 if sign > 0 else 2)
    take(rules, stamp, other)
    assert nearest(rules)[stamp] == (((1 if sign > 0 else 2), 1) if is_told else (None, 1))


@pytest.mark.parametrize(
    ("before", "delay", "is_sharp", "is_told"),
    [
        pytest.param(95, 10, False, False, id="may_both_be_of_it"),
        pytest.param(105, 10, False, True, id="too_early"),
        pytest.param(95, 900, False, False, id="however_long_it_is_written"),
        pytest.param(95, 10, True, True, id="the_drift_is_known"),
    ],
)
def test_nor_is_what_comes_right_before_a_publication(
    rules: duckdb.DuckDBPyConnection, before: int, delay: int, *, is_sharp: bool, is_told: bool
) -> None:
    """In the middle of a second, half a second after its begin, 200 ppm are 100 µs."""
    clock(rules, (0, 100, 0))
    rules.execute("UPDATE store.stamp_clock SET is_sharp = ?", [is_sharp])
    publish(rules, 1, 0, 10 * MICROSECOND)
    publish(rules, 2, SECOND // 2, SECOND // 2 + MILLISECOND)
    stamp = SECOND // 2 + delay * MICROSECOND
    take(rules, 5, SECOND // 2 - before * MICROSECOND, stamp)
    assert nearest(rules) == {5: (1, 1), stamp: (2, 1) if is_told else (None, 1)}


def test_but_what_is_taken_before_a_publication_is_never_of_it(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    clock(rules, (0, 100, 0))
    rules.execute("UPDATE store.stamp_clock SET is_sharp = false")
    publish(rules, 1, SECOND // 2, SECOND // 2 + MILLISECOND)
    early = SECOND // 2 - 50 * MICROSECOND
    take(rules, early, taken=SECOND // 2)
    take(rules, SECOND // 2 + 1)
    assert nearest(rules) == {SECOND // 2 + 1: (1, 1)}


@pytest.mark.parametrize("threads", [(1, 1, 1), (1, 2, 2), (1, 1, 2), (1, 2, 1)])
def test_no_publication_of_a_second_ago_was_just_missed(
    rules: duckdb.DuckDBPyConnection, threads: tuple[int, ...]
) -> None:
    """Whichever threads share the publisher."""
    clock(rules, (0, 100, 0), (0, 100, 0), (0, 100, 0))
    rules.execute("UPDATE store.stamp_clock SET is_sharp = false")
    for number, thread in enumerate(threads):
        written = number * SECOND
        publish(rules, number, written, written + 10 * MICROSECOND, thread=thread)
    take(rules, *(number * SECOND + 5 for number in range(3)))
    assert nearest(rules) == {number * SECOND + 5: (number, 1) for number in range(3)}


def test_but_those_of_two_subscriptions_are_no_burst(rules: duckdb.DuckDBPyConnection) -> None:
    clock(rules, (0, 100, 0))
    rules.execute("UPDATE store.stamp_clock SET is_sharp = false")
    publish(rules, 1, 0, MILLISECOND)
    take_alone(rules, 5, 10_000)
    take_alone(rules, 6, 20_000)
    assert nearest(rules) == {10_000: (1, 1), 20_000: (1, 1)}


@pytest.mark.parametrize(
    ("missed", "is_sharp", "ends", "is_told"),
    [
        (95, False, True, False),
        (105, False, True, True),
        (95, True, True, True),
        (95, False, False, False),
    ],
)
@pytest.mark.parametrize("is_next", [True, False])
def test_where_no_drift_is_known_what_a_message_just_missed_counts(
    rules: duckdb.DuckDBPyConnection,
    missed: int,
    *,
    is_next: bool,
    is_sharp: bool,
    is_told: bool,
    ends: bool,
) -> None:
    """The next write, or one of another thread that ended right before; too far for a burst.

    In the middle of a second, half a second after its begin, 200 ppm are 100 µs.
    """
    clock(rules, (0, 100, 0))
    rules.execute("UPDATE store.stamp_clock SET is_sharp = ?", [is_sharp])
    written = SECOND // 2
    stamp = written + 900 * MICROSECOND
    publish(rules, 1, written, stamp + 50 * MICROSECOND)
    if is_next:
        following = stamp + missed * MICROSECOND
        publish(rules, 2, following, following + 10 * MICROSECOND if ends else None)
    else:
        publish(rules, 2, stamp - 500 * MICROSECOND, stamp - missed * MICROSECOND, thread=2)
    # Of another topic, nothing was missed.
    publish(rules, 3, stamp - MICROSECOND, stamp + MICROSECOND, "/b")
    take(rules, stamp)
    take(rules, stamp, topic="/b")
    rows = rules.execute(
        "SELECT topic_name, publication_id FROM derive.nearest_message(1)"
    ).fetchall()
    assert set(rows) == {("/a", 1 if is_told else None), ("/b", 3)}
