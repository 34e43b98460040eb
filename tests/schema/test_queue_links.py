"""Links by a queue against queues that really held messages: first in, first out, with a bound."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

import duckdb
import pytest
from support.rules import derived
from support.thorough import few

TABLES = {
    "store.annotation": "run_id = 1, annotation_id = 1, kind = 'queue', queue_depth",
    "store.annotation_input": "annotation_id = 1, subscription_id = 1",
    "store.subscription": "subscription_id = 1, created_ns = 0",
    "store.thread_break": "run_id = 1, thread_id, resumed_event_id",
}
STAGE = """
CREATE TABLE annotated (run_id BIGINT DEFAULT 1, annotation_id BIGINT DEFAULT 1,
    kind VARCHAR DEFAULT 'queue', publication_id BIGINT, publisher_id BIGINT DEFAULT 1,
    trace_id BIGINT DEFAULT 1, thread_id BIGINT DEFAULT 2, start_ns BIGINT, start_event_id BIGINT,
    callback_instance_id BIGINT, subscription_id BIGINT);
CREATE TABLE run (subscription_id BIGINT DEFAULT 1, callback_instance_id BIGINT,
    thread_id BIGINT DEFAULT 1, start_event_id BIGINT);
INSERT INTO store.annotation_input DEFAULT VALUES;
INSERT INTO store.subscription DEFAULT VALUES;
"""
LINKS = """
SELECT publication_id, callback_instance_id, candidate_count
FROM derive.link_causal_queue(1, 'annotated', 'run') ORDER BY ALL
"""


@pytest.fixture
def rules() -> Iterator[duckdb.DuckDBPyConnection]:
    with derived(STAGE, ("link_causal_queue",), TABLES) as con:
        yield con


def links(
    con: duckdb.DuckDBPyConnection, come: list[int], published: list[int], depth: int | None = None
) -> list[tuple[int, int, int]]:
    """Return (publication, message, candidates); both are numbered from 1 and have these times."""
    con.execute("TRUNCATE annotated; TRUNCATE run; TRUNCATE store.annotation")
    con.execute("INSERT INTO store.annotation (queue_depth) VALUES (?)", [depth])
    for number, at in enumerate(come, start=1):
        con.execute(
            "INSERT INTO run (callback_instance_id, start_event_id) VALUES (?, ?)", [number, at]
        )
    for number, at in enumerate(published, start=1):
        con.execute(
            "INSERT INTO annotated (publication_id, start_ns, start_event_id) VALUES (?, ?, ?)",
            [number, at, at],
        )
    found: list[tuple[int, int, int]] = con.execute(LINKS).fetchall()
    return found


@pytest.mark.parametrize("seed", few(range(20)))
def test_what_a_queue_held(rules: duckdb.DuckDBPyConnection, seed: int) -> None:
    random = Random(seed)
    depth = random.choice((None, 1, 2, 3))
    come, at = [], 0
    for _ in range(30):
        at += random.randint(5, 20)
        come.append(10 * at)
    waiting: list[int] = []
    truth, published = [], []
    free, left = 0, list(enumerate(come, start=1))
    while left or waiting:
        if not waiting:
            number, moment = left.pop(0)
            waiting.append(number)
            free = max(free, moment)
        number = waiting.pop(0)
        # Times of messages are whole tens: nothing happens at the same moment.
        free = 10 * (free // 10 + random.randint(1, 25)) + 3
        while left and left[0][1] < free:
            waiting.append(left.pop(0)[0])
        del waiting[: 0 if depth is None else -depth]
        published.append(free)
        truth.append((len(published), number, 1))
    assert links(rules, come, published, depth) == truth


def test_a_publication_too_many_answers_none(rules: duckdb.DuckDBPyConnection) -> None:
    """It shows that a message before it was published for twice, or not at all."""
    assert links(rules, [10, 20, 60], [15, 25, 35, 65]) == [(1, 1, 2), (2, 2, 2), (4, 3, 1)]
    assert links(rules, [10, 20], [5, 15, 25]) == [(2, 1, 1), (3, 2, 1)]
    assert links(rules, [10, 11], [5, 15, 25]) == [(2, 1, 1), (3, 2, 1)]


def test_a_depth_that_what_came_out_contradicts(rules: duckdb.DuckDBPyConnection) -> None:
    """Four messages came and four were answered: none was lost, though two waited at once."""
    assert links(rules, [10, 20, 30, 40], [35, 45, 55, 65], depth=1) == [
        (1, 1, 1),
        (2, 2, 2),
        (3, 3, 2),
        (4, 4, 2),
    ]


def test_what_may_be_missing_makes_the_count_doubtful(rules: duckdb.DuckDBPyConnection) -> None:
    """From the first gap on, of the thread that publishes or that gets the messages."""
    breaks = "INSERT INTO store.thread_break (thread_id, resumed_event_id) VALUES"
    rules.execute(f"{breaks} (2, 30), (2, 99), (3, 1)")
    assert links(rules, [10, 20], [15, 35]) == [(1, 1, 1), (2, 2, 2)]
    rules.execute(f"{breaks} (1, 14)")
    assert links(rules, [10, 20], [15, 35]) == [(1, 1, 2), (2, 2, 2)]
    rules.execute("DELETE FROM store.thread_break")
    assert links(rules, [10], [15]) == [(1, 1, 1)]
    rules.execute("UPDATE store.subscription SET created_ns = NULL")
    assert links(rules, [10], [15]) == [(1, 1, 2)]


def test_several_threads_that_publish_may_overtake_each_other(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """But for callbacks, of which a group runs one after the other on any thread."""
    links(rules, [10, 20], [15, 25])
    rules.execute("UPDATE annotated SET thread_id = 3 WHERE publication_id = 2")
    assert rules.execute(LINKS).fetchall() == [(1, 1, 2), (2, 2, 2)]
    rules.execute("UPDATE annotated SET callback_instance_id = 9 WHERE publication_id = 2")
    assert rules.execute(LINKS).fetchall() == [(1, 1, 1), (2, 2, 1)]


def test_every_output_answers_every_message(rules: duckdb.DuckDBPyConnection) -> None:
    """What an input publishes in its own callback is another link."""
    rules.execute("INSERT INTO store.annotation (annotation_id) VALUES (1)")
    rules.execute("INSERT INTO run (callback_instance_id, start_event_id) VALUES (1, 10), (2, 20)")
    rules.execute(
        "INSERT INTO annotated (publication_id, publisher_id, start_event_id, subscription_id)"
        " VALUES (1, 1, 30, NULL), (2, 2, 31, NULL), (3, 1, 32, 1), (4, 1, 40, NULL)"
    )
    assert rules.execute(LINKS).fetchall() == [(1, 1, 1), (2, 1, 1), (4, 2, 1)]


def test_each_input_of_an_annotation_has_a_count_of_its_own(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    """The last message of the first one comes too late for the second publication."""
    rules.execute("""
    INSERT INTO store.annotation (annotation_id) VALUES (1), (2);
    INSERT INTO store.annotation_input VALUES (1, 2), (2, 3), (2, 1);
    INSERT INTO store.subscription VALUES (2, 0), (3, NULL);
    INSERT INTO run (subscription_id, callback_instance_id, start_event_id)
    VALUES (1, 11, 10), (2, 21, 11), (3, 31, 12), (2, 22, 20), (3, 32, 22), (1, 12, 30);
    INSERT INTO annotated (annotation_id, publication_id, publisher_id, start_event_id)
    VALUES (1, 1, 1, 15), (2, 2, 2, 16), (1, 3, 1, 25), (2, 4, 2, 26);
    """)
    assert rules.execute(LINKS).fetchall() == [
        (1, 11, 2), (1, 21, 1), (2, 11, 2), (2, 31, 2), (3, 22, 1), (4, 32, 2)
    ]  # fmt: skip
