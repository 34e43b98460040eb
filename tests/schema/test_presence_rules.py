"""When each process was recorded, and when not: each comparison of the rules from both sides."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest
from support.rules import derived

# Process 1 is in trace 1, which lasts from 100 to 900.
TABLES = {
    "derive.recording": "run_id = 1, trace_id, recording_id",
    "store.trace": "trace_id, domain, start_ns = 100, end_ns = 900",
    "store.process": "process_id = 1, first_seen_ns",
    "store.publication": "run_id = 1, process_id = 1, trace_id = 1, start_ns, end_ns",
    "store.take": "run_id = 1, process_id = 1, trace_id = 1, taken_ns",
    "store.callback_instance": "run_id = 1, process_id = 1, trace_id = 1, start_ns, end_ns",
    "store.node": "run_id = 1, process_id = 1, created_ns",
    "store.gap": "trace_id = 1, kind, start_ns, end_ns",
    "store.executor_state": "run_id = 1, thread_id, start_ns",
    "store.thread": "thread_id, process_id = 1",
}
STAGE = """
CREATE TABLE store.publisher AS FROM store.node;
CREATE TABLE store.subscription AS FROM store.node;
INSERT INTO derive.recording (trace_id, recording_id) VALUES (1, 1);
INSERT INTO store.trace (trace_id) VALUES (1);
"""
RULES = ("process_presence", "process_gap", "lossy_start")
CREATED = "INSERT INTO store.{} (run_id, process_id, created_ns) VALUES (1, 1, {})"
# A gap of this kind.
GAP = "INSERT INTO store.gap (kind, start_ns, end_ns) VALUES ('{}', {}, {})"
SEEN = "INSERT INTO store.process (first_seen_ns) VALUES ({})"
CALLED = "INSERT INTO store.callback_instance (start_ns, end_ns) VALUES ({}, {})"
# Trace 2 is another recording of the process; or a chunk of the same one.
AGAIN = "INSERT INTO derive.recording (trace_id, recording_id) VALUES (2, {})"
SECOND = "INSERT INTO store.trace (trace_id, start_ns, end_ns) VALUES (2, {}, {})"
LATER = "INSERT INTO store.callback_instance (trace_id, start_ns, end_ns) VALUES (2, {}, {})"


@pytest.fixture
def con() -> Iterator[duckdb.DuckDBPyConnection]:
    with derived(STAGE, RULES, TABLES) as connection:
        yield connection


def told(con: duckdb.DuckDBPyConnection, columns: str, *statements: str) -> list[tuple[int, ...]]:
    for statement in statements:
        con.execute(statement)
    return con.execute(f"SELECT {columns} FROM derive.process_presence ORDER BY ALL").fetchall()


def gaps(con: duckdb.DuckDBPyConnection, *statements: str) -> list[tuple[int, int]]:
    for statement in statements:
        con.execute(statement)
    return con.execute(
        "SELECT start_ns, covered_until_ns FROM derive.process_gap(1) ORDER BY ALL"
    ).fetchall()


@pytest.mark.parametrize(
    ("seen", "created", "lost", "expected"),
    [
        pytest.param(50, None, None, (300, False, 300), id="existed_before"),
        pytest.param(99, None, None, (300, False, 300), id="just_before"),
        pytest.param(100, None, None, (100, False, 100), id="first_event_of_any_kind"),
        pytest.param(200, None, None, (200, False, 200), id="later"),
        pytest.param(200, 301, None, (200, False, 200), id="created_after_it_did_something"),
        pytest.param(200, 300, None, (200, True, 100), id="created_before"),
        pytest.param(50, 100, None, (300, True, 100), id="created_when_the_recording_began"),
        pytest.param(50, 99, None, (300, False, 300), id="created_before_the_recording"),
        pytest.param(50, None, 300, (300, False, 100), id="lost_before"),
        pytest.param(50, None, 301, (300, False, 300), id="lost_later"),
    ],
)
def test_from_when_on_a_process_was_recorded(
    con: duckdb.DuckDBPyConnection,
    seen: int,
    created: int | None,
    lost: int | None,
    expected: tuple[int, bool, int],
) -> None:
    """Its first callback is at 300."""
    statements = [SEEN.format(seen), CALLED.format(300, 400)]
    if created is not None:
        # One that was created later says nothing.
        statements += [CREATED.format("node", created), CREATED.format("publisher", 500)]
    if lost is not None:
        statements += [GAP.format("loss", lost, lost + 100), GAP.format("pause", 150, 160)]
    columns = "first_ns, is_born, recorded_from_ns"
    assert told(con, columns, *statements) == [expected]


@pytest.mark.parametrize("table", ["node", "publisher", "subscription"])
def test_the_first_object_of_any_kind(con: duckdb.DuckDBPyConnection, table: str) -> None:
    made = CREATED.format(table, 200)
    assert told(con, "is_born", SEEN.format(150), CALLED.format(300, 400), made) == [(True,)]


def test_what_a_process_did_first_and_last(con: duckdb.DuckDBPyConnection) -> None:
    """Callbacks that were never seen to end count, too."""
    columns = "recording_id, begin_ns, end_ns, first_ns, last_ns"
    statements = [SEEN.format(0), CALLED.format(300, 400)]
    assert told(con, columns, *statements) == [(1, 100, 900, 300, 400)]
    published = "INSERT INTO store.publication (start_ns, end_ns) VALUES (250, 450)"
    assert told(con, columns, published) == [(1, 100, 900, 250, 450)]
    taken = "INSERT INTO store.take (taken_ns) VALUES (220), (470)"
    assert told(con, columns, taken) == [(1, 100, 900, 220, 470)]
    assert told(con, columns, CALLED.format(500, "NULL")) == [(1, 100, 900, 220, 500)]


def test_chunks_of_a_recording_are_one(con: duckdb.DuckDBPyConnection) -> None:
    columns = "recording_id, begin_ns, end_ns, first_ns, last_ns"
    found = told(con, columns, SEEN.format(0), CALLED.format(300, 400), AGAIN.format(1),
                 SECOND.format(950, 1_500), LATER.format(1_000, 1_100))  # fmt: skip
    assert found == [(1, 100, 1_500, 300, 1_100)]


def test_traces_of_the_kernel_record_no_process(con: duckdb.DuckDBPyConnection) -> None:
    kernel = "UPDATE store.trace SET domain = 'kernel'"
    assert told(con, "process_id", SEEN.format(0), CALLED.format(300, 400), kernel) == []


def test_a_gap_of_the_recording_is_one_of_its_processes(con: duckdb.DuckDBPyConnection) -> None:
    """Each row says how far those before it reach, too."""
    born = [SEEN.format(150), CREATED.format("node", 200), CALLED.format(300, 400)]
    lost = [GAP.format("loss", 500, 700), GAP.format("packet", 600, 650)]
    assert gaps(con, *born, *lost) == [(500, 700), (600, 700)]


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        pytest.param((300, 450), (750, 800), (450, 750), id="from_event_to_event"),
        pytest.param((300, 500), (700, 800), (500, 700), id="at_its_borders"),
        pytest.param((300, 501), (699, 800), (300, 800), id="within_it"),
        pytest.param((300, None), (750, 800), (300, 750), id="an_end_that_was_not_seen"),
    ],
)
def test_a_pause_of_a_process(
    con: duckdb.DuckDBPyConnection,
    before: tuple[int, int | None],
    after: tuple[int, int],
    expected: tuple[int, int],
) -> None:
    """From the last event before it to the first one behind it."""
    born = [SEEN.format(150), CREATED.format("node", 200)]
    called = [CALLED.format(before[0], before[1] or "NULL"), CALLED.format(*after)]
    assert gaps(con, *born, *called, GAP.format("pause", 500, 700)) == [expected]


@pytest.mark.parametrize(
    "statement",
    [
        "INSERT INTO store.publication (start_ns, end_ns) VALUES (480, 490), (710, 720)",
        "INSERT INTO store.publication (start_ns, end_ns) VALUES (470, 490), (710, 760)",
        "INSERT INTO store.take (taken_ns) VALUES (490), (710)",
        "INSERT INTO store.callback_instance (start_ns, end_ns) VALUES (490, NULL), (710, NULL)",
        "INSERT INTO store.executor_state (thread_id, start_ns) VALUES (5, 490), (5, 710)",
    ],
)
def test_everything_that_a_process_does_bounds_its_pause(
    con: duckdb.DuckDBPyConnection, statement: str
) -> None:
    born = [SEEN.format(150), CREATED.format("node", 200), CALLED.format(300, 400)]
    thread = "INSERT INTO store.thread (thread_id) VALUES (5)"
    pause = GAP.format("pause", 500, 700)
    assert gaps(con, *born, CALLED.format(800, 810), pause, thread) == [(400, 800)]
    assert gaps(con, statement) == [(490, 710)]


def test_a_pause_that_nothing_is_seen_around(con: duckdb.DuckDBPyConnection) -> None:
    born = [SEEN.format(150), CREATED.format("node", 200), CALLED.format(550, 600)]
    assert gaps(con, *born, GAP.format("pause", 500, 700)) == [(500, 700)]


def test_who_existed_before_is_recorded_from_its_first_event_on(
    con: duckdb.DuckDBPyConnection,
) -> None:
    """What was created within the recording has no gap before."""
    assert gaps(con, SEEN.format(50), CALLED.format(300, 400)) == [(100, 299)]
    assert gaps(con, CREATED.format("node", 200)) == []


@pytest.mark.parametrize(("begin", "expected"), [(901, [(400, 1_000)]), (900, []), (500, [])])
def test_between_two_recordings(
    con: duckdb.DuckDBPyConnection, begin: int, expected: list[tuple[int, int]]
) -> None:
    """From the last event in the one to the first in the other, unless they overlap."""
    born = [SEEN.format(150), CREATED.format("node", 200), CALLED.format(300, 400)]
    again = [AGAIN.format(2), SECOND.format(begin, 1_500), LATER.format(1_000, 1_100)]
    assert gaps(con, *born, *again) == expected


@pytest.mark.parametrize(
    ("seen", "called", "kind", "start", "is_lossy"),
    [
        pytest.param(200, 300, "loss", 300, True, id="before_the_first_callback"),
        pytest.param(200, 300, "loss", 301, False, id="later"),
        pytest.param(200, 300, "pause", 250, False, id="a_pause"),
        pytest.param(200, None, "loss", 200, True, id="before_it_was_seen"),
        pytest.param(200, None, "loss", 201, False, id="later_than_that"),
    ],
)
def test_what_may_have_been_lost_when_a_process_was_created(
    con: duckdb.DuckDBPyConnection,
    seen: int,
    called: int | None,
    kind: str,
    start: int,
    *,
    is_lossy: bool,
) -> None:
    con.execute(SEEN.format(seen))
    con.execute(GAP.format(kind, start, start + 10))
    con.execute("INSERT INTO store.take (taken_ns) VALUES (800)")
    if called is not None:
        con.execute(CALLED.format(called, called + 10))
    found = con.execute("SELECT process_id FROM derive.lossy_start").fetchall()
    assert found == [(1,)] * is_lossy


@pytest.mark.parametrize(("kind", "is_lossy"), [("loss", True), ("pause", False)])
def test_what_began_in_the_recording_can_only_be_lost(
    con: duckdb.DuckDBPyConnection, kind: str, *, is_lossy: bool
) -> None:
    for statement in (SEEN.format(150), CREATED.format("node", 200), CALLED.format(300, 400)):
        con.execute(statement)
    con.execute(GAP.format(kind, 500, 600))
    found = con.execute("SELECT process_id FROM derive.lossy_start").fetchall()
    assert found == [(1,)] * is_lossy


COPIES = """
CREATE TABLE store.link_transport AS FROM (VALUES (1, 1, 1, true), (1, 1, 1, true),
    (1, 2, 1, false), (1, 3, 2, true), (1, 4, 1, NULL))
    AS l (run_id, publisher_id, subscription_id, is_copy);
CREATE TABLE store.subscription AS FROM (VALUES (1, true), (2, false))
    AS s (subscription_id, is_inferred);
"""


def test_placeholders_that_get_copies() -> None:
    with derived(COPIES, ("copied_pair",)) as con:
        assert con.execute("FROM derive.copied_pair").fetchall() == [(1, 1, 1)]
