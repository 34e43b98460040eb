"""Which processes of equal ids are several, computed from the names of their threads."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest

from msgflow.ingest.overlapping_traces import statements

STAGE = """
CREATE SCHEMA raw;
CREATE TABLE raw.thread (thread_index BIGINT, trace_index BIGINT, vpid BIGINT, pid_ns BIGINT);
CREATE TABLE raw.thread_name (thread_index BIGINT, procname VARCHAR, first_event_id BIGINT);
CREATE TABLE raw.ros2_rcl_init (thread_index BIGINT, event_id BIGINT);
CREATE TABLE raw.ros2_callback_start (thread_index BIGINT, event_id BIGINT, callback BIGINT);
CREATE TABLE raw.ros2_callback_end (thread_index BIGINT, event_id BIGINT, callback BIGINT,
    previous_callback_event_id BIGINT);
CREATE TABLE session_trace (host VARCHAR, session BIGINT, trace_index BIGINT);
CREATE TABLE session_container (session BIGINT, container BIGINT);
CREATE TABLE process_namespace (host VARCHAR, vpid BIGINT, pid_ns BIGINT);
INSERT INTO session_trace VALUES ('a', 1, 1), ('a', 2, 2), ('b', 3, 3);
"""

Given = list[tuple[int, int, str | None, int]]


@pytest.fixture
def con() -> Iterator[duckdb.DuckDBPyConnection]:
    """Two sessions of one host and one of another, without threads."""
    with duckdb.connect(config={"threads": 1}) as con:
        con.execute(STAGE)
        yield con


def thread(
    con: duckdb.DuckDBPyConnection,
    index: int,
    *names: str | None,
    trace: int = 1,
    vpid: int = 7,
    pid_ns: int | None = None,
) -> None:
    """A thread and its names, one after the other: at the events 1, 2, … of its own hundred."""
    con.execute("INSERT INTO raw.thread VALUES (?, ?, ?, ?)", [index, trace, vpid, pid_ns])
    con.executemany(
        "INSERT INTO raw.thread_name VALUES (?, ?, ?)",
        [(index, name, 100 * index + n) for n, name in enumerate(names, 1)],
    )


def alternating(con: duckdb.DuckDBPyConnection) -> list[tuple[str, int, str]]:
    body = statements().header("alternating_name").body
    return sorted(con.execute(body).fetchall())


def given(con: duckdb.DuckDBPyConnection) -> Given:
    con.execute(f"CREATE TABLE alternating_name AS {statements().header('alternating_name').body}")
    return sorted(con.execute(statements().header("given_namespace").body).fetchall(), key=str)


def test_a_name_that_comes_back_is_of_another_process(con: duckdb.DuckDBPyConnection) -> None:
    """Other threads, of this host and of another, keep their names or change them once."""
    thread(con, 1, "x", "y", "x")
    thread(con, 2, "z", "w", vpid=8)
    thread(con, 3, "x", trace=3)
    thread(con, 4, "v", vpid=9)
    assert alternating(con) == [("a", 7, "x"), ("a", 7, "y")]
    assert given(con) == [(1, 7, "x", -1), (1, 7, "y", -2), (2, 7, "x", -1), (2, 7, "y", -2)]


def test_each_host_counts_its_own(con: duckdb.DuckDBPyConnection) -> None:
    thread(con, 1, "x", "y", "x")
    thread(con, 2, "q", "r", "q", trace=3)
    assert given(con) == [
        (1, 7, "x", -1),
        (1, 7, "y", -2),
        (2, 7, "x", -1),
        (2, 7, "y", -2),
        (3, 7, "q", -1),
        (3, 7, "r", -2),
    ]


def test_all_threads_of_a_name_are_of_its_process(con: duckdb.DuckDBPyConnection) -> None:
    """Also where they keep it; but not those of another name or process."""
    thread(con, 1, "x", "y", "x")
    thread(con, 2, "x", trace=2)
    thread(con, 3, "k", trace=2)
    thread(con, 4, "y", vpid=8)
    assert given(con) == [(1, 7, "x", -1), (1, 7, "y", -2), (2, 7, "x", -1), (2, 7, "y", -2)]


def test_names_from_before_an_initialisation_do_not_count(con: duckdb.DuckDBPyConnection) -> None:
    """Nor is one that another thread did, or that comes later, of this one."""
    thread(con, 1, "x", "y", "x")
    con.execute("INSERT INTO raw.ros2_rcl_init VALUES (1, 103)")
    assert alternating(con) == []
    con.execute("UPDATE raw.ros2_rcl_init SET event_id = 104")
    assert alternating(con) == [("a", 7, "x"), ("a", 7, "y")]
    con.execute("UPDATE raw.ros2_rcl_init SET thread_index = 2, event_id = 103")
    assert alternating(con) == [("a", 7, "x"), ("a", 7, "y")]


def test_one_name_seen_twice_and_events_without_a_name(con: duckdb.DuckDBPyConnection) -> None:
    thread(con, 1, "x", "x", "y", "y")
    thread(con, 2, "x", None, "x", vpid=8)
    assert alternating(con) == []


def test_a_known_namespace_counts_more_than_names_and_containers(
    con: duckdb.DuckDBPyConnection,
) -> None:
    thread(con, 1, "x", "y", "x", pid_ns=5)
    thread(con, 2, "z", trace=2, pid_ns=6)
    con.execute("INSERT INTO session_container VALUES (2, 2)")
    assert alternating(con) == []
    assert given(con) == []


def test_other_sessions_know_the_namespace(con: duckdb.DuckDBPyConnection) -> None:
    """Of that process of that host; events without a process have none."""
    thread(con, 1, "x")
    thread(con, 2, "y", vpid=8)
    thread(con, 3, "z", trace=3)
    thread(con, 4, "n", vpid=-1)
    con.execute("INSERT INTO process_namespace VALUES ('a', 7, 40), ('a', -1, 41)")
    assert given(con) == [(1, 7, "x", 40), (2, 7, "x", 40)]


def test_containers_count_more_than_names(con: duckdb.DuckDBPyConnection) -> None:
    """On their host; the first container has no number, so its processes keep what they have."""
    thread(con, 1, "x", "y", "x")
    thread(con, 2, "q", "r", "q", trace=3)
    con.execute("INSERT INTO session_container VALUES (2, 2)")
    assert given(con) == [(2, 7, "x", -2), (2, 7, "y", -2), (3, 7, "q", -1), (3, 7, "r", -2)]


@pytest.mark.parametrize(
    ("begin", "end", "callback", "is_one"),
    [
        pytest.param(101, 102, 9, True, id="renamed_inside"),
        pytest.param(102, 102, 9, False, id="one_name"),
        pytest.param(150, 160, 9, False, id="names_of_another_thread"),
        pytest.param(101, 102, 8, False, id="another_callback"),
    ],
)
def test_a_thread_that_renames_itself_in_a_callback_is_one(
    con: duckdb.DuckDBPyConnection, begin: int, end: int, callback: int, *, is_one: bool
) -> None:
    """Nothing of that says whether those of another process, or of another host, are.

    Another instance of the callback began under the first name.
    """
    thread(con, 1, "x", "y", "x")
    thread(con, 4, "o", vpid=9)
    con.execute("UPDATE raw.thread_name SET first_event_id = 145 WHERE thread_index = 4")
    thread(con, 2, "p", "q", "p", vpid=8)
    thread(con, 3, "p", "q", "p", trace=3)
    con.execute("INSERT INTO raw.ros2_callback_start VALUES (1, ?, 9)", [begin])
    con.execute("INSERT INTO raw.ros2_callback_start VALUES (1, 101, 9)")
    con.execute("INSERT INTO raw.ros2_callback_end VALUES (1, ?, ?, ?)", [end, callback, begin])
    others = [("a", 8, "p"), ("a", 8, "q"), ("b", 7, "p"), ("b", 7, "q")]
    assert alternating(con) == ([] if is_one else [("a", 7, "x"), ("a", 7, "y")]) + others
