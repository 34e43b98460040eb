"""Why the publication of a take is not known, each number and comparison of the rule."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest
from support.rules import derived

MS = 1_000_000
# One take of a message of /a; its publisher, process 1, is recorded from 100 to 900 ms.
STAMP = 500 * MS
TABLES = {
    "store.take": (
        "run_id = 1, take_id = 1, subscription_id = 1, process_id = 9, method = 'rmw', "
        f"taken_ns = {STAMP + MS}, is_loss_affected = false, source_timestamp_ns = {STAMP}"
    ),
    "store.link_transport": (
        "run_id = 1, take_id, publication_id, subscription_id = 1, method = 'ring_buffer'"
    ),
    "store.subscription": (
        "run_id = 1, subscription_id = 1, process_id = 9, topic_name = '/a', created_ns, "
        "is_inferred = false, is_internal = false"
    ),
    "store.publisher": (
        "run_id = 1, process_id = 1, publisher_id = 1, topic_name = '/a', created_ns = 0, "
        "is_inferred = false, is_internal = false"
    ),
    "store.callback_instance": "take_id, is_intra_process",
    "store.node": "run_id = 1, process_id, is_inferred",
    "store.publication": (
        "run_id = 1, publication_id, process_id = 1, publisher_id = 1, source_timestamp_ns, end_ns"
    ),
    "store.process": (
        f"process_id, host_id = 1, first_seen_ns = {100 * MS}, last_seen_ns = {900 * MS}"
    ),
    "store.trace": "run_id = 1, domain, start_ns",
    "store.nearest_message": (
        f"run_id = 1, topic_name = '/a', source_timestamp_ns = {STAMP}, publication_id, "
        "candidate_count = 2"
    ),
    "derive.stamp_shift": "run_id = 1, host_id = 1, from_ns, shift_ns, greatest_shift_ns",
    "derive.process_presence": (
        f"run_id = 1, process_id = 1, begin_ns = {100 * MS}, recorded_from_ns = {100 * MS}"
    ),
    "derive.process_gap": "process_id = 1, start_ns, covered_until_ns",
    "derive.unstamped_call": "process_id, publisher_id, is_without_event",
}
STAGE = f"""
INSERT INTO store.subscription (created_ns) VALUES (0);
INSERT INTO store.process (process_id) VALUES (1), (2), (9);
INSERT INTO store.publication (publication_id, process_id, source_timestamp_ns) VALUES (0, 9, 1);
INSERT INTO store.trace (start_ns) VALUES ({100 * MS});
INSERT INTO store.trace (domain, start_ns) VALUES ('kernel', 0);
"""
RULES = ("delivery_limit", "unlinked_take", "orphan_take")
TAKE = "INSERT INTO store.take (take_id) VALUES (1)"
SENDER = "INSERT INTO store.publisher (process_id) VALUES (1)"
RECORDED = "INSERT INTO derive.process_presence (process_id) VALUES (1)"
OTHER = "INSERT INTO store.publisher (process_id, topic_name) VALUES (2, {})"
# A take out of a ring buffer, of process 9, has no stamp.
BUFFERED = (
    "INSERT INTO store.take (method, source_timestamp_ns, taken_ns) "
    f"VALUES ('ring_buffer', NULL, {STAMP})"
)


@pytest.fixture
def con() -> Iterator[duckdb.DuckDBPyConnection]:
    with derived(STAGE, RULES, TABLES) as connection:
        yield connection


def reason(con: duckdb.DuckDBPyConnection, *statements: str) -> str:
    for statement in statements:
        con.execute(statement)
    rows = con.execute("SELECT reason FROM derive.orphan_take(1) WHERE take_id = 1").fetchall()
    ((found,),) = rows
    return str(found)


def missed(start: int, end: int, process: int = 1) -> str:
    return f"INSERT INTO process_gap VALUES ({process}, {start}, {end})"


def seen_until(end: int, process: int = 1) -> str:
    return f"UPDATE store.process SET last_seen_ns = {end} WHERE process_id = {process}"


def recorded(process: int, begin: int, since: int) -> str:
    return (
        "INSERT INTO derive.process_presence (process_id, begin_ns, recorded_from_ns) "
        f"VALUES ({process}, {begin}, {since})"
    )


def shifted(least: int, greatest: int, since: int = 0) -> str:
    return (
        "INSERT INTO derive.stamp_shift (from_ns, shift_ns, greatest_shift_ns) "
        f"VALUES ({since}, {least}, {greatest})"
    )


def test_a_sender_that_was_recorded_all_the_time(con: duckdb.DuckDBPyConnection) -> None:
    assert reason(con, TAKE, SENDER, RECORDED) == "publisher_not_traced"


@pytest.mark.parametrize(
    ("publisher", "topic", "expected"),
    [
        (7, "/a", "publisher_without_events"),
        (1, "/a", "publisher_not_traced"),
        (7, "/b", "publisher_not_traced"),
    ],
)
@pytest.mark.parametrize("last", [900 * MS, STAMP - 1])
def test_a_publisher_that_was_never_seen_to_publish(
    con: duckdb.DuckDBPyConnection, publisher: int, topic: str, expected: str, last: int
) -> None:
    """The player of a bag, before Jazzy: no more than its initialisation shows."""
    other = (
        "INSERT INTO store.publisher (process_id, publisher_id, topic_name) "
        f"VALUES (2, {publisher}, '{topic}')"
    )
    if last < STAMP and expected == "publisher_not_traced":
        expected = "publisher_trace_ends"
    ends = (seen_until(last, 1), seen_until(last, 2))
    assert (
        reason(con, TAKE, SENDER, RECORDED, recorded(2, 100 * MS, 100 * MS), other, *ends)
        == expected
    )


@pytest.mark.parametrize(
    ("since", "expected"), [(STAMP, "publisher_not_traced"), (STAMP + 1, "before_tracing")]
)
def test_a_stamp_of_before_its_sender_was_recorded(
    con: duckdb.DuckDBPyConnection, since: int, expected: str
) -> None:
    assert reason(con, TAKE, SENDER, recorded(1, 100 * MS, since)) == expected


@pytest.mark.parametrize(
    ("since", "expected"), [(STAMP, "publisher_not_traced"), (STAMP + 1, "before_tracing")]
)
def test_a_sender_that_did_nothing_is_recorded_from_its_first_event_on(
    con: duckdb.DuckDBPyConnection, since: int, expected: str
) -> None:
    first = f"UPDATE store.process SET first_seen_ns = {since} WHERE process_id = 1"
    assert reason(con, TAKE, SENDER, first) == expected


@pytest.mark.parametrize(
    ("begin", "expected"), [(STAMP, "publisher_not_traced"), (STAMP + 1, "before_tracing")]
)
def test_a_topic_without_senders_from_the_first_trace_on(
    con: duckdb.DuckDBPyConnection, begin: int, expected: str
) -> None:
    """Not of the kernel: that tells of no message."""
    begins = f"UPDATE store.trace SET start_ns = {begin} WHERE domain IS NULL"
    assert reason(con, TAKE, begins) == expected


@pytest.mark.parametrize(("since", "expected"), [(STAMP, "unknown"), (STAMP + 1, "before_tracing")])
def test_all_that_are_known_to_send_were_recorded_later(
    con: duckdb.DuckDBPyConnection, since: int, expected: str
) -> None:
    """One of two proves nothing; nor does one whose topic is not known."""
    expected_of_all = reason(
        con, TAKE, SENDER, OTHER.format("'/a'"), OTHER.format("NULL"),
        recorded(1, 100 * MS, STAMP + 1), recorded(2, 100 * MS, since),
    )  # fmt: skip
    assert expected_of_all == expected


@pytest.mark.parametrize(
    ("known", "since", "expected"),
    [
        (True, STAMP + 1, "unknown"),
        (False, STAMP + 1, "before_tracing"),
        (False, STAMP, "publisher_not_traced"),
    ],
)
def test_who_might_send_counts_where_nobody_is_known_to(
    con: duckdb.DuckDBPyConnection, *, known: bool, since: int, expected: str
) -> None:
    """The one that might was recorded later, the one that does was not."""
    senders = [SENDER, RECORDED] if known else []
    later = recorded(2, 100 * MS, since)
    assert reason(con, TAKE, OTHER.format("NULL"), later, *senders) == expected


@pytest.mark.parametrize(
    "statement",
    [
        OTHER.format("NULL"),
        "INSERT INTO store.publisher (process_id, topic_name, is_inferred) VALUES (2, '/b', true)",
        "INSERT INTO store.subscription (process_id, subscription_id, is_inferred) "
        "VALUES (2, 2, true)",
        "INSERT INTO store.node (process_id, is_inferred) VALUES (2, true)",
    ],
)
def test_whose_initialisation_is_missing_may_send(
    con: duckdb.DuckDBPyConnection, statement: str
) -> None:
    """It has a gap. Placeholders of ROS itself, and what was seen to be made, say nothing."""
    hidden = [TAKE, SENDER, RECORDED, missed(STAMP, STAMP, process=2)]
    assert reason(con, *hidden) == "publisher_not_traced"
    assert reason(con, statement) == "publisher_gap"
    if "is_inferred" in statement:
        for table in ("publisher", "subscription", "node"):
            con.execute(f"UPDATE store.{table} SET is_inferred = false")
        assert reason(con) == "publisher_not_traced"


@pytest.mark.parametrize(
    "placeholder",
    [
        "store.publisher (process_id, topic_name, is_inferred, is_internal) "
        "VALUES (2, '/b', true, true)",
        "store.subscription (process_id, subscription_id, is_inferred, is_internal) "
        "VALUES (2, 2, true, true)",
    ],
)
def test_placeholders_of_services_do_not_make_a_sender(
    con: duckdb.DuckDBPyConnection, placeholder: str
) -> None:
    hidden = [TAKE, SENDER, RECORDED, missed(STAMP, STAMP, process=2)]
    assert reason(con, *hidden, f"INSERT INTO {placeholder}") == "publisher_not_traced"


def test_of_a_message_without_a_topic_everybody_may_be_the_sender(
    con: duckdb.DuckDBPyConnection,
) -> None:
    no_topic = "UPDATE store.subscription SET topic_name = NULL"
    hidden = missed(STAMP, STAMP, process=2)
    assert reason(con, TAKE, no_topic, OTHER.format("'/b'"), hidden) == "publisher_gap"


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [
        (STAMP + MS, STAMP + 2 * MS, "publisher_gap"),
        (STAMP + MS + 1, STAMP + 2 * MS, "publisher_not_traced"),
        (STAMP - 2 * MS, STAMP - MS, "publisher_gap"),
        (STAMP - 2 * MS, STAMP - MS - 1, "publisher_not_traced"),
    ],
)
def test_a_stamp_and_its_publication_lie_within_a_millisecond(
    con: duckdb.DuckDBPyConnection, start: int, end: int, expected: str
) -> None:
    assert reason(con, TAKE, SENDER, RECORDED, missed(start, end)) == expected


@pytest.mark.parametrize(
    ("created", "expected"),
    [(STAMP + MS, "publisher_gap"), (STAMP + MS + 1, "publisher_not_traced")],
)
def test_who_was_created_later_did_not_send(
    con: duckdb.DuckDBPyConnection, created: int, expected: str
) -> None:
    late = f"UPDATE store.publisher SET created_ns = {created}"
    assert reason(con, TAKE, SENDER, late, RECORDED, missed(STAMP, STAMP)) == expected


@pytest.mark.parametrize(("more", "expected"), [(0, "publisher_not_traced"), (1, "before_tracing")])
def test_who_was_created_before_it_was_recorded_may_have_sent_before(
    con: duckdb.DuckDBPyConnection, more: int, expected: str
) -> None:
    created = 600 * MS
    late = f"UPDATE store.publisher SET created_ns = {created}"
    known_from = recorded(1, created + more, created + more)
    assert reason(con, TAKE, SENDER, late, known_from) == expected


@pytest.mark.parametrize(
    ("end", "expected"), [(STAMP, "publisher_not_traced"), (STAMP - 1, "publisher_trace_ends")]
)
def test_a_stamp_behind_the_last_event_of_its_sender(
    con: duckdb.DuckDBPyConnection, end: int, expected: str
) -> None:
    assert reason(con, TAKE, SENDER, RECORDED, seen_until(end)) == expected


@pytest.mark.parametrize(
    ("end", "since", "expected"),
    [
        (STAMP, STAMP, "publisher_not_traced"),
        (STAMP - 1, STAMP, "unknown"),
        (STAMP, STAMP + 1, "unknown"),
    ],
)
def test_one_of_two_senders_was_not_recorded_then(
    con: duckdb.DuckDBPyConnection, end: int, since: int, expected: str
) -> None:
    found = reason(
        con, TAKE, SENDER, RECORDED, OTHER.format("'/a'"), seen_until(end, 2),
        recorded(2, 100 * MS, since),
    )  # fmt: skip
    assert found == expected


def test_all_that_are_known_to_send_ended(con: duckdb.DuckDBPyConnection) -> None:
    """And not who might; of whom alone it tells, too."""
    ended = [OTHER.format("NULL"), seen_until(STAMP - 1)]
    assert reason(con, TAKE, SENDER, RECORDED, *ended) == "publisher_trace_ends"
    assert reason(con, "DELETE FROM store.publisher WHERE process_id = 1") == "publisher_not_traced"
    assert reason(con, seen_until(STAMP, 2)) == "publisher_not_traced"
    assert reason(con, seen_until(STAMP - 1, 2)) == "publisher_trace_ends"


@pytest.mark.parametrize(
    ("end", "stamp", "topic", "expected"),
    [
        (STAMP - MS, "NULL", "NULL", "unknown"),
        (STAMP + MS, "NULL", "NULL", "unknown"),
        (STAMP - MS - 1, "NULL", "NULL", "publisher_trace_ends"),
        (STAMP + MS + 1, "NULL", "NULL", "publisher_trace_ends"),
        (STAMP, "7", "NULL", "publisher_trace_ends"),
        (STAMP, "NULL", "'/b'", "publisher_trace_ends"),
    ],
)
def test_who_published_then_on_a_topic_that_is_not_known_may_have_sent_it(
    con: duckdb.DuckDBPyConnection, end: int, stamp: str, topic: str, expected: str
) -> None:
    """Unless its message is known; though all that are known to send had ended."""
    published = (
        "UPDATE store.publisher SET publisher_id = process_id;"
        "INSERT INTO store.publisher (process_id, publisher_id, topic_name, created_ns) "
        f"VALUES (2, 3, {topic}, 0);"
        "INSERT INTO store.publication (process_id, publisher_id, source_timestamp_ns, end_ns) "
        f"VALUES (2, 3, {stamp}, {end})"
    )
    found = reason(
        con, TAKE, SENDER, RECORDED, OTHER.format("NULL"), seen_until(STAMP - 1), published
    )
    assert found == expected


@pytest.mark.parametrize(
    ("end", "expected"),
    [
        (STAMP - 5 * MS - 1, "publisher_trace_ends"),
        (STAMP - 5 * MS, "unknown"),
        (STAMP, "unknown"),
        (STAMP + 1, "publisher_trace_ends"),
    ],
)
def test_who_published_on_a_topic_that_is_not_known_was_stamped_soon_or_late(
    con: duckdb.DuckDBPyConnection, end: int, expected: str
) -> None:
    """Between 1 and 4 ms behind its events, give or take 1 ms."""
    published = (
        "UPDATE store.publisher SET publisher_id = process_id;"
        f"INSERT INTO store.publication (process_id, publisher_id, end_ns) VALUES (2, 2, {end})"
    )
    found = reason(
        con, TAKE, SENDER, RECORDED, OTHER.format("NULL"), shifted(-4 * MS, -MS),
        seen_until(STAMP - 2 * MS), published,
    )  # fmt: skip
    assert found == expected


@pytest.mark.parametrize(
    ("created", "stamp", "expected"),
    [
        (STAMP, "NULL", "unknown"),
        (STAMP, "7", "publisher_not_traced"),
        (STAMP + 1, "NULL", "publisher_not_traced"),
    ],
)
def test_a_sender_whose_publications_have_no_stamps(
    con: duckdb.DuckDBPyConnection, created: int, stamp: str, expected: str
) -> None:
    published = (
        f"INSERT INTO store.publication (publication_id, source_timestamp_ns) VALUES (1, {stamp})"
    )
    late = f"UPDATE store.publisher SET created_ns = {created}"
    assert reason(con, TAKE, SENDER, RECORDED, late, published) == expected


@pytest.mark.parametrize(
    ("topic", "is_without_event", "expected"),
    [
        ("/a", "true", "unknown"),
        ("/a", "false", "publisher_not_traced"),
        ("/b", "true", "publisher_not_traced"),
    ],
)
def test_a_sender_whose_publications_on_the_topic_have_no_event_of_the_middleware(
    con: duckdb.DuckDBPyConnection, topic: str, is_without_event: str, expected: str
) -> None:
    """Others of its process have stamps."""
    published = (
        "INSERT INTO store.publication (publication_id, source_timestamp_ns) VALUES (1, 7);"
        f"INSERT INTO store.publisher (publisher_id, topic_name) VALUES (5, '{topic}');"
        "INSERT INTO store.publication (publisher_id, source_timestamp_ns) VALUES (5, 1);"
        f"INSERT INTO unstamped_call VALUES (1, 5, {is_without_event})"
    )
    assert reason(con, TAKE, SENDER, RECORDED, published) == expected


@pytest.mark.parametrize(
    ("end", "expected"),
    [(STAMP + 9_999, "publisher_trace_ends"), (STAMP + 10_000, "publisher_not_traced")],
)
def test_a_message_is_stamped_a_while_before_or_behind_its_publication(
    con: duckdb.DuckDBPyConnection, end: int, expected: str
) -> None:
    """At the latest 10 µs before it: then nothing of its sender was left."""
    shift = shifted(-90_000, 10_000)
    assert reason(con, TAKE, SENDER, RECORDED, shift, seen_until(end)) == expected


@pytest.mark.parametrize(
    ("end", "expected"), [(STAMP + 9_999, "unknown"), (STAMP + 10_000, "publisher_not_traced")]
)
def test_which_of_two_senders_was_left_then(
    con: duckdb.DuckDBPyConnection, end: int, expected: str
) -> None:
    shift = shifted(-90_000, 10_000)
    found = reason(
        con, TAKE, SENDER, RECORDED, OTHER.format("'/a'"), shift, seen_until(end, 2),
        recorded(2, 100 * MS, 100 * MS),
    )  # fmt: skip
    assert found == expected


@pytest.mark.parametrize(
    ("since", "expected"),
    [(STAMP, "publisher_gap"), (STAMP + 1, "publisher_not_traced"), (0, "publisher_gap")],
)
def test_a_stamp_is_brought_to_the_clock_of_the_sender(
    con: duckdb.DuckDBPyConnection, since: int, expected: str
) -> None:
    """From that time of the clock of stamps on; there the sender has a gap, 300 ms later."""
    shift = shifted(300 * MS, 300 * MS, since)
    hidden = missed(STAMP + 300 * MS, STAMP + 300 * MS)
    assert reason(con, TAKE, SENDER, RECORDED, shift, hidden) == expected


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [
        (0, STAMP - 5 * MS, "publisher_gap"),
        (0, STAMP - 5 * MS - 1, "publisher_not_traced"),
        (STAMP, STAMP + 9 * MS, "publisher_gap"),
        (STAMP + 1, STAMP + 9 * MS, "publisher_not_traced"),
    ],
)
def test_a_gap_hides_a_publication_that_was_stamped_soon_or_late(
    con: duckdb.DuckDBPyConnection, start: int, end: int, expected: str
) -> None:
    """Between 1 and 4 ms behind its events, give or take 1 ms."""
    found = reason(con, TAKE, SENDER, RECORDED, shifted(-4 * MS, -MS), missed(start, end))
    assert found == expected


def test_who_was_created_later_on_its_own_clock(con: duckdb.DuckDBPyConnection) -> None:
    shift = shifted(300 * MS, 400 * MS)
    late = f"UPDATE store.publisher SET created_ns = {STAMP + 301 * MS}"
    hidden = missed(STAMP + 300 * MS, STAMP + 300 * MS)
    assert reason(con, TAKE, SENDER, RECORDED, shift, late, hidden) == "publisher_gap"
    assert reason(con, f"{late} + 1") == "publisher_not_traced"


@pytest.mark.parametrize(
    "statement",
    [
        f"INSERT INTO store.publication (source_timestamp_ns) VALUES ({STAMP})",
        f"INSERT INTO store.publication (source_timestamp_ns, publisher_id) VALUES ({STAMP}, NULL)",
        "INSERT INTO store.nearest_message (publication_id) VALUES (NULL)",
    ],
)
def test_several_messages_may_be_it(con: duckdb.DuckDBPyConnection, statement: str) -> None:
    """A gap, or that its sender ended, says more."""
    assert reason(con, TAKE, SENDER, RECORDED, statement) == "ambiguous"
    assert reason(con, seen_until(STAMP - 1)) == "publisher_trace_ends"
    assert reason(con, missed(STAMP, STAMP)) == "publisher_gap"


@pytest.mark.parametrize(
    ("topic", "stamp", "expected"),
    [
        ("/a", STAMP, "clock_set"),
        ("/a", STAMP + 1, "publisher_not_traced"),
        ("/b", STAMP, "publisher_not_traced"),
    ],
)
def test_the_clock_was_set(
    con: duckdb.DuckDBPyConnection, topic: str, stamp: int, expected: str
) -> None:
    """When the message was stamped is not known then, so neither a gap nor an end says more."""
    statement = (
        "INSERT INTO store.nearest_message (topic_name, source_timestamp_ns, candidate_count) "
        f"VALUES ('{topic}', {stamp}, NULL)"
    )
    assert reason(con, TAKE, SENDER, RECORDED, statement) == expected
    if expected == "clock_set":
        assert reason(con, missed(STAMP, STAMP), seen_until(STAMP - 1)) == "clock_set"


@pytest.mark.parametrize(
    ("lossy", "host", "expected"),
    [("true", 1, "receiver_gap"), ("false", 1, "no_stamp"), ("true", 2, "no_stamp")],
)
def test_a_take_without_a_stamp(
    con: duckdb.DuckDBPyConnection, lossy: str, host: int, expected: str
) -> None:
    """A gap explains it only where takes of the same host have stamps."""
    plain = (
        "INSERT INTO store.take (method, source_timestamp_ns, is_loss_affected) "
        f"VALUES ('rclcpp', NULL, {lossy})"
    )
    stamped = "INSERT INTO store.take (take_id, process_id) VALUES (2, 2)"
    place = f"UPDATE store.process SET host_id = {host} WHERE process_id = 2"
    assert reason(con, plain, SENDER, stamped, place) == expected


@pytest.mark.parametrize(
    ("method", "host", "expected"),
    [
        ("ring_buffer", 1, "receiver_gap"),
        ("ring_buffer", 2, "no_stamp"),
        ("rmw", 1, "no_stamp"),
    ],
)
def test_what_comes_from_a_buffer_without_an_event(
    con: duckdb.DuckDBPyConnection, method: str, host: int, expected: str
) -> None:
    """Before Iron nothing has one that leaves a buffer. The callback tells that it did."""
    found = reason(
        con,
        "INSERT INTO store.take (method, source_timestamp_ns, is_loss_affected) "
        "VALUES ('callback_only', NULL, true)",
        "INSERT INTO store.callback_instance VALUES (1, true)",
        SENDER,
        f"INSERT INTO store.take (take_id, process_id, method) VALUES (2, 2, '{method}')",
        f"UPDATE store.process SET host_id = {host} WHERE process_id = 2",
    )
    assert found == expected


@pytest.mark.parametrize(
    ("method", "stamp", "expected"),
    [("ring_buffer", "NULL", "no_stamp"), ("rmw", "7", "publisher_not_traced")],
)
def test_a_take_beside_a_gap_that_lacks_nothing(
    con: duckdb.DuckDBPyConnection, method: str, stamp: str, expected: str
) -> None:
    """Messages in buffers have no stamps. Others of the host have some, or lack them."""
    found = reason(
        con,
        "INSERT INTO store.take (method, source_timestamp_ns, is_loss_affected) "
        f"VALUES ('{method}', {stamp}, true)",
        SENDER, RECORDED, "UPDATE derive.process_presence SET recorded_from_ns = 0",
        "UPDATE store.process SET first_seen_ns = 0",
        "INSERT INTO store.take (take_id, process_id) VALUES (2, 2)",
        "INSERT INTO store.take (take_id, source_timestamp_ns) VALUES (3, NULL)",
    )  # fmt: skip
    assert found == expected


def before(taken: int, put: int) -> list[str]:
    """A message that left the buffer before, and when its publication ended."""
    return [
        f"INSERT INTO store.take (take_id, method, taken_ns) VALUES (2, 'ring_buffer', {taken})",
        "INSERT INTO store.link_transport (take_id, publication_id) VALUES (2, 7)",
        f"INSERT INTO store.publication (publication_id, end_ns) VALUES (7, {put})",
    ]


@pytest.mark.parametrize(
    ("taken", "put", "start", "end", "expected"),
    [
        (STAMP - 1, 300 * MS, 200 * MS, 300 * MS, "publisher_gap"),
        (STAMP - 1, 300 * MS, 200 * MS, 300 * MS - 1, "no_stamp"),
        (STAMP, 300 * MS, 200 * MS, 300 * MS - 1, "publisher_gap"),
        (STAMP - 1, 300 * MS, STAMP, STAMP + 1, "publisher_gap"),
        (STAMP - 1, 300 * MS, STAMP + 1, STAMP + 2, "no_stamp"),
    ],
)
def test_a_message_was_put_into_a_buffer_behind_the_one_before_it(
    con: duckdb.DuckDBPyConnection, taken: int, put: int, start: int, end: int, expected: str
) -> None:
    """And before it was taken: a gap within that time may hide how."""
    found = reason(con, BUFFERED, *before(taken, put), missed(start, end, process=9),
                   recorded(9, 0, 0))  # fmt: skip
    assert found == expected


@pytest.mark.parametrize(
    ("put", "since", "expected"),
    [
        (300 * MS, 300 * MS, "no_stamp"),
        (300 * MS, 300 * MS + 1, "before_tracing"),
    ],
)
def test_it_may_have_been_put_there_before_the_recording(
    con: duckdb.DuckDBPyConnection, put: int, since: int, expected: str
) -> None:
    assert reason(con, BUFFERED, *before(STAMP - 1, put), recorded(9, 0, since)) == expected


@pytest.mark.parametrize(
    ("created", "expected"), [(100 * MS, "no_stamp"), (100 * MS - 1, "before_tracing")]
)
def test_the_first_message_was_put_behind_the_creation(
    con: duckdb.DuckDBPyConnection, created: int, expected: str
) -> None:
    made = f"UPDATE store.subscription SET created_ns = {created}"
    assert reason(con, BUFFERED, made, recorded(9, 0, 100 * MS)) == expected


@pytest.mark.parametrize(
    ("topic", "stamp", "created", "taken", "expected"),
    [
        ("/b", STAMP, 400 * MS, STAMP + MS, "receiver_gap"),
        # Its own topic, another message, or none.
        ("/a", STAMP, 400 * MS, STAMP + MS, "ambiguous"),
        ("/b", STAMP + 1, 400 * MS, STAMP + MS, "publisher_not_traced"),
        # The subscription was created in the gap, or at its end, or behind it.
        ("/b", STAMP, 420 * MS, STAMP + MS, "receiver_gap"),
        ("/b", STAMP, 420 * MS + 1, STAMP + MS, "publisher_not_traced"),
        # The take was before the gap.
        ("/b", STAMP, 400 * MS, 410 * MS, "receiver_gap"),
        ("/b", STAMP, 400 * MS, 410 * MS - 1, "publisher_not_traced"),
    ],
)
def test_a_message_of_another_topic_behind_a_gap(
    con: duckdb.DuckDBPyConnection,
    topic: str, stamp: int, created: int, taken: int, expected: str,
) -> None:  # fmt: skip
    """The handle may be that of another subscription by then."""
    con.execute("INSERT INTO store.publisher (publisher_id, topic_name) VALUES (7, ?)", [topic])
    con.execute(
        "INSERT INTO store.publication (publication_id, publisher_id, source_timestamp_ns) "
        "VALUES (1, 7, ?)",
        [stamp],
    )
    con.execute("UPDATE store.subscription SET created_ns = ?", [created])
    con.execute("INSERT INTO store.take (taken_ns) VALUES (?)", [taken])
    assert reason(con, SENDER, RECORDED, missed(410 * MS, 420 * MS, process=9)) == expected
