"""Why messages were not delivered, each number and comparison of the rules from both sides."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest
from support.rules import derived, insert

MS = 1_000_000
# The input of the rules, without the views and tables that it comes from.
TABLES = {
    "derive.expected_arrival": (
        "run_id = 1, publication_id, publisher_id = 1, topic_name = '/a', clock_id = 1, "
        "source_timestamp_ns = 1, arrival_ns, has_one_clock = true"
    ),
    "derive.subscription_life": (
        "run_id = 1, subscription_id = 1, topic_name = '/a', process_id = 1, clock_id = 1, "
        "queue_depth = 10, created_ns = 0, last_seen_ns = 10_000_000_000, replaced_ns, "
        "host_end_ns = 10_000_000_000, only_thread_id = 1, shows_takes = true, "
        "is_agnocast = false"
    ),
    "derive.process_gap": "process_id = 1, start_ns, covered_until_ns",
    "store.publisher": "publisher_id, created_ns, process_id = 1",
    "derive.copied_pair": "publisher_id, subscription_id",
    "store.link_transport": (
        "run_id = 1, publication_id, publisher_id = 1, subscription_id = 1, take_id, "
        "is_copy = false"
    ),
    "store.take": (
        "run_id = 1, take_id, subscription_id = 1, taken_ns, source_timestamp_ns = 1, "
        "method = 'rmw'"
    ),
    "store.publication": (
        "run_id = 1, publication_id, publisher_id, process_id = 1, thread_id, end_ns"
    ),
    "store.process": "process_id, host_id",
    "store.host": "host_id, clock_id",
    "derive.clock_step": "clock_id = 1, start_ns, end_ns",
    "store.callback_instance": "take_id, is_intra_process",
    "derive.empty_take": "run_id = 1, subscription_id = 1, failed_ns",
    "derive.hanging_callback": "run_id = 1, thread_id",
    "derive.executor_interval": "run_id = 1, thread_id = 1, state = 'wait', start_ns, end_ns",
}
STAGE = """
CREATE VIEW store.orphan_take AS
    SELECT t.run_id, t.take_id
    FROM store.take AS t
    ANTI JOIN store.link_transport AS l ON t.take_id = l.take_id;
INSERT INTO store.process VALUES (1, 1);
INSERT INTO store.host VALUES (1, 1);
INSERT INTO store.publisher VALUES (1, 0, 1), (2, 0, 1);
"""
RULES = ("delivery_limit", "undelivered")


class Delivery:
    """One subscription, and what was published for it. Times in ns."""

    def __init__(self, con: duckdb.DuckDBPyConnection) -> None:
        self._con = con
        self._count = 0
        # (number, publisher, thread, arrival, taken) of what is not in the tables yet.
        self._published: list[tuple[int, int, int, int, int | None]] = []

    @property
    def con(self) -> duckdb.DuckDBPyConnection:
        """The tables, with all that was published."""
        rows, self._published = self._published, []
        taken = [row for row in rows if row[4] is not None]
        for table, names, of, found in (
            ("derive.expected_arrival", "publication_id, publisher_id, arrival_ns", "013", rows),
            ("store.publication", "publication_id, publisher_id, thread_id, end_ns", "0123", rows),
            ("store.link_transport", "publication_id, publisher_id, take_id", "010", taken),
            ("store.take", "take_id, taken_ns", "04", taken),
        ):
            insert(self._con, table, names, [[row[int(n)] for n in of] for row in found])
        return self._con

    def lives(self, **columns: int | None) -> None:
        names = "".join(f", {name}" for name in columns)
        marks = "".join(", ?" for _ in columns)
        self.con.execute(
            f"INSERT INTO derive.subscription_life (run_id{names}) VALUES (1{marks})",
            list(columns.values()),
        )

    def publish(
        self, arrival: int, taken: int | None = None, publisher: int = 1, thread: int = 1
    ) -> int:
        """Publish a message that arrives, and is taken, at these times; return its number."""
        self._count += 1
        self._published.append((self._count, publisher, thread, arrival, taken))
        return self._count

    def miss(self) -> int:
        """Publish a message that is taken, then one that is not; return the number of that."""
        self.publish(0, 300_000)
        return self.publish(300 * MS)

    def fails(self, at: int) -> None:
        """Attempt to take, and find nothing."""
        self.con.execute("INSERT INTO derive.empty_take (failed_ns) VALUES (?)", [at])

    def takes_without_message(self, at: int) -> None:
        """Take what has no stamp, and what has one: that cannot be of a message with another."""
        self.con.execute(
            "INSERT INTO store.take (take_id, taken_ns, source_timestamp_ns) "
            "VALUES (99, ?, NULL), (98, ?, 7)",
            [at, 305 * MS],
        )
        self.con.execute("UPDATE derive.expected_arrival SET source_timestamp_ns = 5")

    def waits(self, start: int, end: int) -> None:
        self.con.execute(
            "INSERT INTO derive.executor_interval (start_ns, end_ns) VALUES (?, ?)", [start, end]
        )

    def misses(self, start: int, end: int) -> None:
        self.con.execute(
            "INSERT INTO process_gap (start_ns, covered_until_ns) VALUES (?, ?)", [start, end]
        )

    def reason(self, number: int) -> str:
        rows = self.con.execute(
            "SELECT reason FROM derive.undelivered(1) WHERE publication_id = ?", [number]
        ).fetchall()
        ((reason,),) = rows
        return str(reason)


@pytest.fixture
def delivery() -> Iterator[Delivery]:
    with derived(STAGE, RULES, TABLES) as con:
        yield Delivery(con)


def usually(delivery: Delivery, usual: int) -> None:
    """Ten messages that need so long; but four are quicker, and one is slower."""
    for at in range(10):
        needed = 1_000 if at < 4 else usual + MS if at == 9 else usual
        delivery.publish(at * 20 * MS, at * 20 * MS + needed)


@pytest.mark.parametrize(
    ("usual", "patience"),
    [
        pytest.param(300_000, 3 * MS, id="ten_times_what_is_usual"),
        pytest.param(50_000, MS, id="at_least_a_millisecond"),
    ],
)
@pytest.mark.parametrize(("more", "reason"), [(0, "not_delivered"), (-1, "lost_in_transport")])
def test_a_reader_waits_for_longer_than_messages_take(
    delivery: Delivery, usual: int, patience: int, more: int, reason: str
) -> None:
    """The wait goes on for so long behind the arrival; the next message is taken at once."""
    delivery.lives()
    usually(delivery, usual)
    missing = delivery.publish(300 * MS)
    end = 300 * MS + patience + more
    delivery.waits(280 * MS, end)
    delivery.publish(end, end + usual)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("clock", "start", "end", "reason"),
    [
        (1, 300, 300, "unknown"),
        (1, None, 300, "unknown"),
        (1, 300, None, "unknown"),
        (1, 301, 400, "not_delivered"),
        (1, 200, 299, "not_delivered"),
        (2, 200, 400, "not_delivered"),
    ],
)
def test_while_the_clock_is_set_nothing_is_called_lost(
    delivery: Delivery, clock: int, start: int | None, end: int | None, reason: str
) -> None:
    """Its take is there, but shows no message."""
    delivery.lives()
    usually(delivery, 300_000)
    missing = delivery.publish(300 * MS)
    delivery.waits(280 * MS, 310 * MS)
    delivery.publish(310 * MS, 310 * MS + 300_000)
    bounds = [None if bound is None else bound * MS for bound in (start, end)]
    delivery.con.execute("INSERT INTO clock_step VALUES (?, ?, ?)", [clock, *bounds])
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(("length", "reason"), [(1, "not_delivered"), (0, "lost_in_transport")])
def test_a_wait_is_no_shorter_than_that(delivery: Delivery, length: int, reason: str) -> None:
    """It began before the message arrived; where no longer, it says nothing."""
    delivery.lives()
    usually(delivery, 300_000)
    missing = delivery.publish(300 * MS)
    delivery.waits(300 * MS - length, 303 * MS)
    delivery.publish(303 * MS, 303 * MS + 300_000)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(("more", "reason"), [(1, "never_taken"), (0, "pending_at_end")])
def test_who_never_took_anything_of_a_publisher_had_time(
    delivery: Delivery, more: int, reason: str
) -> None:
    """Ten milliseconds since the first message: one word for all that the pair had."""
    delivery.lives(last_seen_ns=310 * MS + more, host_end_ns=310 * MS + more, created_ns=200 * MS)
    early = delivery.publish(199 * MS)
    messages = [delivery.publish(at * MS) for at in (300, 309)]
    assert delivery.reason(early) == "before_subscription"
    assert [delivery.reason(message) for message in messages] == [reason, reason]


def test_who_never_took_anything_of_one_publisher_took_that_of_another(delivery: Delivery) -> None:
    """Two domains in one recording; what the other one sends, its queue was never to hold."""
    delivery.lives(queue_depth=1)
    for at in range(1, 4):
        delivery.publish(at * 100 * MS, at * 100 * MS + 300_000)
    messages = [delivery.publish(at * 100 * MS + 50 * MS, publisher=2) for at in range(1, 4)]
    delivery.waits(160 * MS, 200 * MS)
    delivery.fails(155 * MS)
    assert {delivery.reason(message) for message in messages} == {"never_taken"}


@pytest.mark.parametrize(("shows_takes", "reason"), [(True, "never_taken"), (False, "unknown")])
def test_takes_that_have_no_event_do_not_show(
    delivery: Delivery, shows_takes: bool, reason: str
) -> None:
    """As before Humble."""
    delivery.lives(queue_depth=1, shows_takes=shows_takes)
    missing = delivery.publish(300 * MS)
    delivery.publish(400 * MS)
    assert delivery.reason(missing) == reason


def test_a_take_without_a_message_may_be_of_a_pair_that_seems_to_have_none(
    delivery: Delivery,
) -> None:
    """That of one message may be known to be another one, but not of the two that came then."""
    delivery.lives(queue_depth=1)
    messages = [delivery.publish(at * MS) for at in (300, 600, 700)]
    delivery.publish(310 * MS, 311 * MS, publisher=2)
    delivery.takes_without_message(310 * MS)
    assert [delivery.reason(message) for message in messages] == ["unknown"] * 2 + [
        "pending_at_end"
    ]


def test_of_a_pair_that_seems_to_have_none_an_earlier_take_is_no_message(
    delivery: Delivery,
) -> None:
    """Nothing shows that the two were connected, though another clock leaves room for it."""
    delivery.lives(queue_depth=1)
    missing = delivery.publish(300 * MS)
    delivery.con.execute(
        "INSERT INTO store.take (take_id, taken_ns, source_timestamp_ns) VALUES (99, ?, NULL)",
        [300 * MS - 1],
    )
    delivery.con.execute("UPDATE derive.expected_arrival SET has_one_clock = false")
    assert delivery.reason(missing) == "never_taken"


@pytest.mark.parametrize(("late", "reason"), [(0, "not_delivered"), (1, "lost_in_transport")])
def test_a_message_that_is_taken_late_shows_a_reader_without_cpu(
    delivery: Delivery, late: int, reason: str
) -> None:
    """More than ten times as late as usual at the end of the wait."""
    delivery.lives()
    usually(delivery, 300_000)
    missing = delivery.publish(300 * MS)
    end = 310 * MS
    delivery.waits(280 * MS, end)
    delivery.publish(end - 3 * MS - late, end + 1)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("depth", "missing", "reason"),
    [
        (1, 1, "not_delivered"),
        (1, 2, "overwritten"),
        (3, 2, "not_delivered"),
        (3, 3, "overwritten"),
    ],
)
def test_as_many_missing_in_a_row_as_a_queue_holds(
    delivery: Delivery, depth: int, missing: int, reason: str
) -> None:
    """Two at least: one alone may be lost at any time. The next is taken behind the wait."""
    delivery.lives(queue_depth=depth)
    usually(delivery, 300_000)
    numbers = [delivery.publish(300 * MS + at) for at in range(missing)]
    delivery.waits(280 * MS, 310 * MS)
    delivery.publish(309 * MS, 310 * MS + 1)
    for at in range(3):
        delivery.publish(310 * MS + 1 - at - 1, 311 * MS + at)
    assert delivery.reason(numbers[0]) == reason


@pytest.mark.parametrize(
    ("slowest", "silent", "reason"),
    [
        pytest.param(300_000, 10 * MS, "pending_at_end", id="ten_milliseconds"),
        pytest.param(300_000, 10 * MS + 1, "subscription_ended", id="more"),
        pytest.param(25 * MS, 25 * MS, "pending_at_end", id="the_slowest_message"),
        pytest.param(25 * MS, 25 * MS + 1, "subscription_ended", id="more_than_that"),
    ],
)
def test_others_go_on_for_longer_than_any_message_took(
    delivery: Delivery, slowest: int, silent: int, reason: str
) -> None:
    """After the first message that a reader may have missed, as it was not seen any more."""
    delivery.lives(last_seen_ns=300 * MS - 1, host_end_ns=300 * MS + silent)
    delivery.publish(0, slowest)
    for at in range(1, 5):
        delivery.publish(at * 30 * MS, at * 30 * MS + 300_000)
    missing = delivery.publish(300 * MS)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("thread", "seen", "reason"),
    [
        pytest.param(1, -1, "reader_in_callback", id="it_reads"),
        pytest.param(2, -1, "subscription_ended", id="another_thread"),
        pytest.param(1, 0, "pending_at_end", id="it_was_seen"),
    ],
)
def test_a_reader_that_did_not_come_back_from_a_callback(
    delivery: Delivery, thread: int, seen: int, reason: str
) -> None:
    delivery.con.execute("INSERT INTO derive.hanging_callback (thread_id) VALUES (?)", [thread])
    delivery.lives(last_seen_ns=300 * MS + seen, host_end_ns=400 * MS)
    missing = delivery.miss()
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(("seen", "reason"), [(0, "pending_at_end"), (-1, "subscription_ended")])
def test_a_reader_that_was_seen_when_the_message_arrived(
    delivery: Delivery, seen: int, reason: str
) -> None:
    delivery.lives(last_seen_ns=300 * MS + seen, host_end_ns=400 * MS)
    missing = delivery.miss()
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(("start", "reason"), [(10, "receiver_gap"), (10 + 1, "pending_at_end")])
def test_a_gap_hides_a_take_for_as_long_as_messages_need(
    delivery: Delivery, start: int, reason: str
) -> None:
    """Behind the last event of the reader, where nothing later was taken: 10 ms at least."""
    delivery.lives(last_seen_ns=300 * MS, host_end_ns=301 * MS)
    delivery.publish(0, 300_000)
    missing = delivery.publish(299 * MS)
    begin = 310 * MS if start == 10 else 310 * MS + 1
    delivery.misses(begin, 900 * MS)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("start", "taken", "reason"),
    [
        (320 * MS + 3 * MS, None, "receiver_gap"),
        (320 * MS + 3 * MS + 1, None, "no_longer_taken"),
        # What the publisher sent next has been taken: the queue was empty.
        (320 * MS + 2 * MS, 320 * MS + 2 * MS, "receiver_gap"),
        (320 * MS + 2 * MS + 1, 320 * MS + 2 * MS, "not_delivered"),
    ],
)
def test_a_gap_hides_what_a_reader_takes_when_it_wakes_up(
    delivery: Delivery, start: int, taken: int | None, reason: str
) -> None:
    """A reader that seemed to wait may have been kept from the CPU: it takes the message then."""
    delivery.lives()
    usually(delivery, 300_000)
    missing = delivery.publish(300 * MS)
    delivery.waits(290 * MS, 320 * MS)
    if taken is not None:
        delivery.publish(taken, taken)
    delivery.misses(start, start + MS)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(("until", "reason"), [(1, "receiver_gap"), (0, "lost_in_transport")])
def test_a_gap_that_ends_before_a_message_arrives(
    delivery: Delivery, until: int, reason: str
) -> None:
    """Or when it does: the first event behind a gap may be the publication itself."""
    delivery.lives()
    missing = delivery.miss()
    delivery.publish(320 * MS, 320 * MS + 300_000)
    delivery.misses(250 * MS, 300 * MS + until)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("created", "publisher", "until", "reason"),
    [
        (100 * MS, 50 * MS, 100 * MS + 1, "unknown"),
        (100 * MS, 50 * MS, 100 * MS, "before_discovery"),
        (50 * MS, 100 * MS, 100 * MS + 1, "unknown"),
        (50 * MS, 100 * MS, 100 * MS, "before_discovery"),
    ],
)
def test_a_gap_hides_what_the_two_knew_of_each_other(
    delivery: Delivery, created: int, publisher: int, until: int, reason: str
) -> None:
    """From the time on when both were there."""
    delivery.con.execute("UPDATE store.publisher SET created_ns = ?", [publisher])
    delivery.lives(created_ns=created)
    missing = delivery.publish(300 * MS)
    delivery.publish(320 * MS, 320 * MS + 300_000)
    delivery.misses(10 * MS, until)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(("newer", "reason"), [(2, "lost_in_transport"), (3, "overwritten")])
def test_as_many_newer_messages_as_fit(delivery: Delivery, newer: int, reason: str) -> None:
    """Of any publisher, until the next one is taken; the message itself does not count."""
    delivery.lives(queue_depth=3)
    missing = delivery.miss()
    for at in range(newer - 1):
        delivery.publish(301 * MS + at, publisher=2)
    delivery.publish(305 * MS, 306 * MS)
    delivery.publish(306 * MS + 1)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("created", "reason"), [(300 * MS, "pending_at_end"), (300 * MS + 1, "before_subscription")]
)
def test_created_before_the_message_arrived(delivery: Delivery, created: int, reason: str) -> None:
    delivery.lives(created_ns=created, last_seen_ns=301 * MS, host_end_ns=301 * MS)
    assert delivery.reason(delivery.publish(300 * MS)) == reason


@pytest.mark.parametrize(
    ("method", "process", "taken", "later", "reason"),
    [
        ("ring_buffer", 1, 302 * MS, 302 * MS, "unknown"),
        ("ring_buffer", 1, 302 * MS, None, "unknown"),
        # The first is one of those that were kept; the second is of what was published later.
        ("ring_buffer", 1, 302 * MS + 1, 302 * MS, "before_subscription"),
        ("ring_buffer", 2, 302 * MS, 303 * MS, "before_subscription"),
        # A message without a stamp may have come from any process; a stamp would identify it.
        ("rmw", 2, 302 * MS, 302 * MS, "unknown"),
        ("rmw", 2, 302 * MS, None, "unknown"),
        ("rmw", 2, 302 * MS + 1, 302 * MS, "before_subscription"),
        ("stamped", 2, 302 * MS, 303 * MS, "before_subscription"),
        # Before Iron, a callback that is handed what comes from a buffer.
        ("callback_only", 1, 302 * MS, 302 * MS, "unknown"),
        ("callback_only", 1, 302 * MS + 1, 302 * MS, "before_subscription"),
    ],
)
def test_what_a_publisher_may_have_kept(
    delivery: Delivery, method: str, process: int, taken: int, later: int | None, reason: str
) -> None:
    """For subscriptions that come later (transient local)."""
    delivery.lives(created_ns=301 * MS, process_id=process)
    missing = delivery.publish(300 * MS)
    delivery.publish(301 * MS + 1, later)
    for take, at in ((98, 400 * MS), (99, taken)):
        delivery.con.execute(
            "INSERT INTO store.take (take_id, taken_ns, source_timestamp_ns, method)"
            " VALUES (?, ?, ?, ?)",
            [take, at, 7 if method == "stamped" else None, method],
        )
        delivery.con.execute(
            "INSERT INTO store.callback_instance VALUES (?, ?)", [take, method == "callback_only"]
        )
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("replaced", "reason"),
    [(None, "pending_at_end"), (400 * MS, "subscription_ended"), (299 * MS, "subscription_ended")],
)
def test_another_subscription_took_its_place(
    delivery: Delivery, replaced: int | None, reason: str
) -> None:
    """Before the message arrived, or before it was taken."""
    delivery.lives(replaced_ns=replaced, last_seen_ns=301 * MS, host_end_ns=301 * MS)
    assert delivery.reason(delivery.publish(300 * MS)) == reason


@pytest.mark.parametrize(
    ("failed", "reason"),
    [
        (300 * MS - 1, "lost_in_transport"),
        (300 * MS, "take_failed"),
        (320 * MS, "take_failed"),
        (320 * MS + 1, "lost_in_transport"),
    ],
)
def test_an_attempt_failed_before_a_later_message_was_taken(
    delivery: Delivery, failed: int, reason: str
) -> None:
    delivery.lives()
    missing = delivery.miss()
    delivery.publish(310 * MS, 320 * MS)
    delivery.fails(failed)
    assert delivery.reason(missing) == reason


def test_a_gap_leaves_open_whether_the_attempt_that_failed_was_the_only_one(
    delivery: Delivery,
) -> None:
    delivery.lives()
    missing = delivery.miss()
    delivery.publish(310 * MS, 320 * MS)
    delivery.fails(305 * MS)
    delivery.misses(306 * MS, 307 * MS)
    assert delivery.reason(missing) == "receiver_gap"


def test_a_take_without_a_message_leaves_open_what_failed(delivery: Delivery) -> None:
    """Either may have been the attempt that took it."""
    delivery.lives()
    missing = delivery.miss()
    delivery.publish(310 * MS, 320 * MS)
    delivery.fails(305 * MS)
    delivery.takes_without_message(315 * MS)
    assert delivery.reason(missing) == "unknown"


@pytest.mark.parametrize(
    ("taken", "has_one_clock", "reason"),
    [
        (300 * MS - 1, True, "lost_in_transport"),
        (300 * MS, True, "unknown"),
        (299 * MS - 1, False, "lost_in_transport"),
        (299 * MS, False, "unknown"),
        (320 * MS, True, "unknown"),
        (320 * MS + 1, True, "lost_in_transport"),
    ],
)
def test_a_take_without_a_message_was_before_a_later_one(
    delivery: Delivery, taken: int, has_one_clock: bool, reason: str
) -> None:
    """It had no stamp, so that it may be of any message; of another clock, of an earlier one."""
    delivery.lives()
    missing = delivery.miss()
    delivery.publish(310 * MS, 320 * MS)
    delivery.takes_without_message(taken)
    delivery.con.execute("UPDATE derive.expected_arrival SET has_one_clock = ?", [has_one_clock])
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(("more", "reason"), [(0, "unknown"), (1, "lost_in_transport")])
@pytest.mark.parametrize(
    ("publisher", "thread", "reader", "until"),
    [
        pytest.param(2, 1, 1, 303 * MS, id="of_another_publisher"),
        pytest.param(1, 2, 1, 303 * MS, id="that_another_thread_sent"),
        pytest.param(1, 1, None, 303 * MS, id="that_another_thread_took"),
        pytest.param(1, 1, 1, 301 * MS, id="not_if_all_is_done_in_order"),
    ],
)
def test_a_later_message_may_have_overtaken_one(
    delivery: Delivery,
    publisher: int, thread: int, reader: int | None, until: int, more: int, reason: str,
) -> None:  # fmt: skip
    """A take without a message is of one that arrived less than ten usual times before."""
    delivery.lives(only_thread_id=reader)
    missing = delivery.miss()
    delivery.publish(300 * MS + 1, 301 * MS, publisher, thread)
    delivery.publish(320 * MS, 320 * MS + 300_000, thread=thread)
    delivery.takes_without_message(until + more)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("first", "reason"), [(300 * MS, "lost_in_transport"), (300 * MS + 1, "before_discovery")]
)
def test_nothing_earlier_of_the_publisher_was_taken(
    delivery: Delivery, first: int, reason: str
) -> None:
    """One that arrived at the same time is not later."""
    delivery.lives()
    missing = delivery.publish(300 * MS)
    delivery.publish(first, 310 * MS)
    delivery.publish(320 * MS, 321 * MS)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(("last", "reason"), [(0, "pending_at_end"), (1, "unknown")])
def test_a_later_message_of_another_publisher_was_taken(
    delivery: Delivery, last: int, reason: str
) -> None:
    """One that arrived at the same time is not later. Only later ones of its own show a loss."""
    delivery.lives(last_seen_ns=400 * MS, host_end_ns=400 * MS)
    missing = delivery.miss()
    delivery.publish(300 * MS + last, 310 * MS, publisher=2)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("later", "start", "reason"),
    [
        pytest.param(0, 320 * MS + 1, "receiver_gap", id="at_the_same_time"),
        pytest.param(1, 320 * MS + 1, "lost_in_transport", id="later"),
        pytest.param(1, 320 * MS, "receiver_gap", id="later_but_taken_within_the_gap"),
    ],
)
def test_a_later_message_of_the_publisher_shows_how_long_a_gap_matters(
    delivery: Delivery, later: int, start: int, reason: str
) -> None:
    """Its messages arrive in order: until the later one was taken. Another one was taken, too."""
    delivery.lives(last_seen_ns=400 * MS)
    missing = delivery.miss()
    delivery.publish(300 * MS + later, 320 * MS)
    delivery.publish(301 * MS, 321 * MS, publisher=2)
    delivery.misses(start, 900 * MS)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("arrival", "taken", "reason"),
    [
        pytest.param(-1, 0, "overwritten", id="taken_when_the_wait_ends"),
        pytest.param(-1, -1, "not_delivered", id="taken_within_the_wait"),
        pytest.param(0, 1, "not_delivered", id="arrives_when_the_wait_ends"),
    ],
)
def test_a_reader_without_cpu_has_the_next_message_during_its_wait(
    delivery: Delivery, arrival: int, taken: int, reason: str
) -> None:
    """It takes that behind the wait."""
    delivery.lives(queue_depth=1)
    usually(delivery, 300_000)
    missing = [delivery.publish(300 * MS + at) for at in range(2)]
    end = 310 * MS
    delivery.waits(280 * MS, end)
    delivery.publish(end + arrival, end + taken)
    delivery.publish(end + MS)
    assert delivery.reason(missing[0]) == reason


@pytest.mark.parametrize(
    ("seen", "first", "second"),
    [
        pytest.param(0, "pending_at_end", "pending_at_end", id="seen_when_it_arrived"),
        pytest.param(-1, "subscription_ended", "subscription_ended", id="seen_before"),
    ],
)
def test_others_go_on_after_the_first_message_that_a_reader_did_not_see(
    delivery: Delivery, seen: int, first: str, second: str
) -> None:
    """10 ms after the second, and more after the first of two."""
    delivery.lives(last_seen_ns=300 * MS + seen, host_end_ns=310 * MS + 1)
    delivery.publish(0, 300_000)
    one = delivery.publish(300 * MS)
    other = delivery.publish(300 * MS + 1)
    assert (delivery.reason(one), delivery.reason(other)) == (first, second)


def test_who_was_seen_when_a_message_arrived_has_not_ended_before(delivery: Delivery) -> None:
    """Only before the next one."""
    delivery.lives(last_seen_ns=300 * MS, host_end_ns=400 * MS)
    delivery.publish(0, 300_000)
    one = delivery.publish(300 * MS)
    other = delivery.publish(301 * MS)
    assert delivery.reason(one) == "pending_at_end"
    assert delivery.reason(other) == "subscription_ended"


@pytest.mark.parametrize(
    ("start", "reason"), [(300 * MS, "unknown"), (300 * MS + 1, "before_discovery")]
)
def test_a_gap_that_begins_when_a_message_arrives(
    delivery: Delivery, start: int, reason: str
) -> None:
    """The next message was taken before publish() returned, and before this one's did."""
    delivery.lives()
    missing = delivery.publish(300 * MS)
    delivery.publish(301 * MS, 290 * MS)
    delivery.misses(start, 305 * MS)
    assert delivery.reason(missing) == reason


@pytest.mark.parametrize(
    ("depth", "newer", "reason"),
    [
        (3, 2, "overwritten"),
        (3, 1, "before_discovery"),
        (3, 3, "before_discovery"),
        # The queue is full with any message: that it is says nothing.
        (1, 0, "before_discovery"),
        (2, 1, "overwritten"),
    ],
)
def test_a_queue_that_was_full_when_the_first_message_was_taken(
    delivery: Delivery, depth: int, newer: int, reason: str
) -> None:
    """The reader came late: that first one is the oldest that the queue still held."""
    delivery.lives(queue_depth=depth)
    missing = [delivery.publish(at * MS) for at in range(100, 110)]
    for at in range(newer + 1):
        delivery.publish((200 + at) * MS, (300 + at) * MS)
    delivery.publish(400 * MS, 401 * MS)
    assert {delivery.reason(message) for message in missing} == {reason}


def test_a_reader_that_waited_before_the_first_message_had_none(delivery: Delivery) -> None:
    """As many as the queue holds came at once, when the two knew each other."""
    delivery.lives(queue_depth=2)
    usually(delivery, 300_000)
    missing = [delivery.publish(at * MS, publisher=2) for at in range(300, 310)]
    delivery.waits(305 * MS, 312 * MS)
    for at in (312, 312):
        delivery.publish(at * MS, at * MS + 300_000, publisher=2)
    assert {delivery.reason(message) for message in missing} == {"before_discovery"}


def test_what_failed_before_the_first_message_was_taken_shows_no_loss(delivery: Delivery) -> None:
    delivery.lives()
    missing = delivery.publish(300 * MS)
    delivery.fails(301 * MS)
    delivery.publish(310 * MS, 311 * MS)
    assert delivery.reason(missing) == "before_discovery"


@pytest.mark.parametrize(
    ("missing_before", "missing_now", "reason"),
    [
        (0, 3, "pending_at_end"),
        (0, 4, "no_longer_taken"),
        (5, 13, "overwritten"),
        (5, 14, "no_longer_taken"),
    ],
)
def test_more_messages_are_missing_than_ever_before(
    delivery: Delivery, missing_before: int, missing_now: int, reason: str
) -> None:
    """Twice as many, beside those that fit in the queue. What came before the first says nothing.

    Nor do those that came when the reader had ended.
    """
    delivery.lives(queue_depth=3, last_seen_ns=900 * MS, host_end_ns=901 * MS)
    for at in range(60):
        delivery.publish(at * MS)
    delivery.publish(100 * MS, 101 * MS)
    for at in range(missing_before):
        delivery.publish((200 + at) * MS)
    delivery.publish(300 * MS, 301 * MS)
    messages = [delivery.publish((400 + at) * MS) for at in range(missing_now)]
    for _ in range(50):
        delivery.publish(900 * MS + 1)
    assert delivery.reason(messages[0]) == reason


@pytest.mark.parametrize(
    ("more", "replaced", "reason"),
    [
        (1, None, "no_longer_taken"),
        (1, 399 * MS, "subscription_ended"),
        (0, None, "pending_at_end"),
    ],
)
def test_a_reader_that_waits_takes_nothing_more(
    delivery: Delivery, more: int, replaced: int | None, reason: str
) -> None:
    """Its queue is empty. The message behind the wait has the same word."""
    delivery.lives(last_seen_ns=400 * MS, host_end_ns=400 * MS, replaced_ns=replaced)
    usually(delivery, 300_000)
    messages = [delivery.publish(at * MS) for at in (300, 399)]
    delivery.waits(280 * MS, 303 * MS - 1 + more)
    assert [delivery.reason(message) for message in messages] == [reason, reason]


def test_a_wait_after_a_take_without_a_message_does_not_show_that_none_is_taken(
    delivery: Delivery,
) -> None:
    """That take was of the message."""
    delivery.lives(last_seen_ns=400 * MS, host_end_ns=400 * MS)
    usually(delivery, 300_000)
    messages = [delivery.publish(at * MS) for at in (300, 399)]
    delivery.waits(302 * MS, 390 * MS)
    delivery.takes_without_message(301 * MS)
    assert [delivery.reason(message) for message in messages] == ["unknown", "pending_at_end"]


def test_a_take_without_a_message_that_comes_later_than_the_wait(delivery: Delivery) -> None:
    """The reader seemed to wait, but got no CPU: the message is no more lost than any other."""
    delivery.lives()
    usually(delivery, 300_000)
    missing = delivery.publish(300 * MS)
    delivery.waits(280 * MS, 309 * MS)
    delivery.takes_without_message(309 * MS + 1)
    delivery.publish(320 * MS, 320 * MS + 300_000)
    assert delivery.reason(missing) == "unknown"


@pytest.mark.parametrize(
    ("depth", "newer", "reason"),
    [
        (2, 1, "pending_at_end"),
        (2, 2, "unknown"),
        (None, 0, "pending_at_end"),
        (None, 1, "unknown"),
    ],
)
def test_messages_stay_in_a_queue_that_nobody_reads(
    delivery: Delivery, depth: int | None, newer: int, reason: str
) -> None:
    """As many as it holds; the last one in any case. It was never seen to get any."""
    delivery.lives(queue_depth=depth, last_seen_ns=310 * MS, host_end_ns=310 * MS)
    missing = delivery.publish(300 * MS)
    for at in range(newer):
        delivery.publish(301 * MS + at)
    assert delivery.reason(missing) == reason


def test_what_was_lost_is_not_told_without_a_depth(delivery: Delivery) -> None:
    """The queue may have held one message."""
    delivery.lives(queue_depth=None)
    missing = delivery.miss()
    delivery.publish(301 * MS, 302 * MS)
    assert delivery.reason(missing) == "unknown"


def test_nothing_is_known_of_a_message_without_a_time_of_arrival(delivery: Delivery) -> None:
    delivery.lives()
    missing = delivery.publish(300 * MS)
    delivery.publish(305 * MS, 306 * MS)
    delivery.con.execute(
        "UPDATE derive.expected_arrival SET arrival_ns = NULL WHERE publication_id = 1"
    )
    assert delivery.reason(missing) == "unknown"


@pytest.mark.parametrize("publishers", [(1, 2), (2, 1)])
def test_messages_that_arrive_at_the_same_moment_come_later_alike(
    delivery: Delivery, publishers: tuple[int, int]
) -> None:
    """The first of all was taken when only four of those that were sent later had arrived."""
    delivery.lives(queue_depth=5)
    one, other = publishers
    delivery.publish(10 * MS, 11 * MS, one)
    delivery.publish(12 * MS, 13 * MS, other)
    missing = delivery.publish(50 * MS)
    delivery.publish(200 * MS, 290 * MS, one)
    delivery.publish(200 * MS, 280 * MS, other)
    delivery.publish(210 * MS, 211 * MS, other)
    for more in range(3):
        delivery.publish((220 + more) * MS, (295 + more) * MS, one)
    assert delivery.reason(missing) == "lost_in_transport"


@pytest.mark.parametrize("taken", [(320 * MS, 330 * MS), (330 * MS, 320 * MS)])
def test_of_messages_of_a_publisher_at_the_same_moment_the_first_take_counts(
    delivery: Delivery, taken: tuple[int, int]
) -> None:
    """An attempt that failed after that was none for the missing message."""
    delivery.lives()
    missing = delivery.miss()
    for at in taken:
        delivery.publish(310 * MS, at)
    delivery.fails(325 * MS)
    assert delivery.reason(missing) == "lost_in_transport"


def test_messages_that_arrive_at_the_same_moment_are_newer_alike(delivery: Delivery) -> None:
    delivery.lives(queue_depth=3)
    missing = delivery.miss()
    for _ in range(3):
        delivery.publish(310 * MS, 310 * MS)
    assert delivery.reason(missing) == "overwritten"


@pytest.mark.parametrize("publisher", [1, 2])
def test_what_is_taken_of_the_same_moment_came_no_later(delivery: Delivery, publisher: int) -> None:
    """Nothing tells in which order they came. What came a nanosecond later overtook it."""
    delivery.lives()
    delivery.publish(0, 300_000)
    delivery.publish(300 * MS, 301 * MS, publisher)
    missing = delivery.publish(300 * MS)
    delivery.publish(300 * MS, 301 * MS, publisher)
    assert delivery.reason(missing) == "pending_at_end"
    delivery.publish(300 * MS + 1, 301 * MS, publisher)
    assert delivery.reason(missing) == ("lost_in_transport" if publisher == 1 else "unknown")


def test_a_message_of_which_nothing_tells_when_it_came_is_no_later_one(
    delivery: Delivery,
) -> None:
    delivery.lives()
    delivery.publish(0, 300_000)
    missing = delivery.publish(300 * MS)
    taken = delivery.publish(400 * MS, 401 * MS)
    assert delivery.reason(missing) == "lost_in_transport"
    unknown = "UPDATE derive.expected_arrival SET arrival_ns = NULL WHERE publication_id = ?"
    delivery.con.execute(unknown, [taken])
    assert delivery.reason(missing) == "pending_at_end"


def test_where_copies_are_taken_nothing_is_missing(delivery: Delivery) -> None:
    delivery.lives()
    delivery.publish(300 * MS)
    delivery.publish(300 * MS, publisher=2)
    delivery.con.execute("INSERT INTO derive.copied_pair VALUES (1, 1)")
    found = delivery.con.execute("SELECT publisher_id FROM derive.undelivered(1)").fetchall()
    assert found == [(2,)]


def test_agnocast_loses_nothing(delivery: Delivery) -> None:
    """What a reader passed over was overwritten, also before the first message that it took."""
    delivery.lives(is_agnocast=True)
    before = delivery.publish(1 * MS)
    delivery.publish(2 * MS, 3 * MS)
    passed = delivery.publish(300 * MS)
    delivery.waits(301 * MS, 900 * MS)
    delivery.publish(901 * MS, 902 * MS)
    last = delivery.publish(9_999 * MS)
    assert [delivery.reason(number) for number in (before, passed, last)] == [
        "overwritten", "overwritten", "pending_at_end",
    ]  # fmt: skip
