"""How causal links are stored: what makes them doubtful, and what annotations take away."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest
from support.rules import derived

# What the rules of each kind of link say, and what they read beside it.
TABLES = {
    "derive.link_causal_take_adjacent": (
        "run_id = 1, thread_id = 1, take_id, subscription_id = 1, taken_ns, publication_id, "
        "publisher_id = 1, start_ns"
    ),
    "derive.link_causal_polled": "run_id, take_id, publication_id, publisher_id, is_loss_affected",
    "derive.link_causal_indirect": (
        "run_id = 1, callback_instance_id, publication_id, kind = 'partial_sync', "
        "annotation_id = 7, candidate_count = 2, is_loss_affected = false"
    ),
    "derive.mixed_publication": "publication_id",
    "derive.declared_pair": "run_id = 1, kind, subscription_id = 1, publisher_id = 1",
    "store.take": "run_id = 1, take_id, subscription_id = 1, is_loss_affected = false",
    "store.publication": "run_id = 1, publication_id, publisher_id = 1, is_loss_affected = false",
    "store.callback_instance": (
        "run_id = 1, callback_instance_id, take_id, is_loss_affected = false"
    ),
    "store.thread_state": "run_id = 1, thread_id = 1, state = 'sleeping', start_ns, end_ns",
}
STAGE = """
CREATE TABLE link (run_id BIGINT DEFAULT 1, callback_instance_id BIGINT, take_id BIGINT,
    publication_id BIGINT, publisher_id BIGINT DEFAULT 1, kind VARCHAR DEFAULT 'direct',
    annotation_id BIGINT, candidate_count BIGINT DEFAULT 1, is_loss_affected BOOLEAN);
CREATE TABLE answer_doubtful (publication_id BIGINT);
CREATE MACRO derive.answer_doubtful(only_run, links) AS TABLE FROM answer_doubtful;
CREATE MACRO derive.answer_to_call(only_run, links) AS TABLE FROM answer_doubtful;
INSERT INTO store.take (take_id) VALUES (1), (2);
"""
RULES = ("causal_link", "link_causal_by_hand", "link_causal_annotated")
BY_HAND = "SELECT take_id, publication_id, candidate_count FROM derive.link_causal_by_hand(1)"


@pytest.fixture
def rules() -> Iterator[duckdb.DuckDBPyConnection]:
    with derived(STAGE, RULES, TABLES) as con:
        yield con


@pytest.mark.parametrize(
    ("declared", "left"),
    [
        pytest.param("independent", {"polled", "partial_sync"}, id="independent"),
        pytest.param(
            "approximate_sync", {"take_adjacent", "polled", "partial_sync"}, id="approximate"
        ),
        pytest.param("direct", {"direct", "take_adjacent", "polled", "partial_sync"}, id="direct"),
        pytest.param(
            "partial_sync", {"direct", "take_adjacent", "polled", "partial_sync"}, id="partial"
        ),
    ],
)
def test_annotations_take_links_away(
    rules: duckdb.DuckDBPyConnection, declared: str, left: set[str]
) -> None:
    rules.execute("INSERT INTO derive.declared_pair (kind) VALUES (?)", [declared])
    rules.execute(
        "INSERT INTO link (take_id, publication_id, kind) VALUES (1, 1, 'direct'), "
        "(1, 2, 'take_adjacent'), (1, 3, 'polled'), (1, 4, 'partial_sync')"
    )
    kinds = rules.execute("SELECT kind FROM derive.causal_link(1, 'link')").fetchall()
    assert {kind for (kind,) in kinds} == left


@pytest.mark.parametrize(
    "pair",
    [
        pytest.param("1, 'independent', 2, 1", id="subscription"),
        pytest.param("1, 'independent', 1, 2", id="publisher"),
        pytest.param("2, 'independent', 1, 1", id="run"),
    ],
)
def test_annotations_of_other_pairs_take_nothing_away(
    rules: duckdb.DuckDBPyConnection, pair: str
) -> None:
    rules.execute(f"INSERT INTO derive.declared_pair VALUES ({pair})")
    rules.execute("INSERT INTO link (take_id, publication_id) VALUES (1, 1), (NULL, 2)")
    found = rules.execute(
        "SELECT publication_id, subscription_id FROM derive.causal_link(1, 'link') ORDER BY ALL"
    ).fetchall()
    assert found == [(1, 1), (2, None)]


def test_a_publication_of_mixed_processes_has_a_second_candidate(
    rules: duckdb.DuckDBPyConnection,
) -> None:
    rules.execute(
        "INSERT INTO link (publication_id, candidate_count, is_loss_affected) "
        "VALUES (1, 1, NULL), (2, 1, false), (3, 3, true)"
    )
    rules.execute("INSERT INTO mixed_publication VALUES (2), (3)")
    found = rules.execute(
        "SELECT publication_id, candidate_count, is_loss_affected "
        "FROM derive.causal_link(1, 'link') ORDER BY ALL"
    ).fetchall()
    assert found == [(1, 1, False), (2, 2, False), (3, 3, True)]


@pytest.mark.parametrize(
    ("state", "candidates"),
    [
        pytest.param("'sleeping', 20, 30", 2, id="slept"),
        pytest.param("'sleeping', 10, 30", 2, id="since_the_take"),
        pytest.param("'sleeping', 20, 50", 2, id="until_the_publication"),
        pytest.param("'sleeping', 9, 30", 1, id="before"),
        pytest.param("'sleeping', 20, 51", 1, id="afterwards"),
        pytest.param("'runnable', 20, 30", 1, id="runnable"),
    ],
)
def test_a_thread_that_slept_since_the_take_begins_a_new_turn(
    rules: duckdb.DuckDBPyConnection, state: str, candidates: int
) -> None:
    rules.execute(f"INSERT INTO store.thread_state (state, start_ns, end_ns) VALUES ({state})")
    # Another thread slept. This one slept in another run.
    rules.execute("INSERT INTO store.thread_state VALUES (1, 2, 'sleeping', 20, 31)")
    rules.execute("INSERT INTO store.thread_state VALUES (2, 1, 'sleeping', 20, 32)")
    rules.execute(
        "INSERT INTO link_causal_take_adjacent (take_id, taken_ns, publication_id, start_ns) "
        "VALUES (1, 10, 1, 50)"
    )
    rules.execute("INSERT INTO store.publication (publication_id) VALUES (1)")
    assert rules.execute(BY_HAND).fetchall() == [(1, 1, candidates)]


@pytest.mark.parametrize(
    ("pair", "candidates"),
    [
        pytest.param("1, 'direct', 1, 1", 1, id="declared"),
        pytest.param("1, 'direct', 2, 1", 2, id="subscription"),
        pytest.param("1, 'direct', 1, 2", 2, id="publisher"),
        pytest.param("2, 'direct', 1, 1", 2, id="run"),
        pytest.param("1, 'partial_sync', 1, 1", 2, id="kind"),
    ],
)
def test_a_declared_answer_is_not_doubtful(
    rules: duckdb.DuckDBPyConnection, pair: str, candidates: int
) -> None:
    rules.execute(f"INSERT INTO derive.declared_pair VALUES ({pair})")
    rules.execute(
        "INSERT INTO link_causal_take_adjacent (take_id, taken_ns, publication_id, start_ns) "
        "VALUES (1, 10, 1, 50), (2, 60, 2, 70)"
    )
    rules.execute("INSERT INTO answer_doubtful VALUES (1)")
    rules.execute("INSERT INTO store.publication (publication_id) VALUES (1), (2)")
    found = rules.execute(f"{BY_HAND} ORDER BY ALL").fetchall()
    assert found == [(1, 1, candidates), (2, 2, 1)]


def test_lost_events_spoil_what_follows_a_take(rules: duckdb.DuckDBPyConnection) -> None:
    rules.execute("INSERT INTO store.take (take_id, is_loss_affected) VALUES (3, true)")
    rules.execute(
        "INSERT INTO link_causal_take_adjacent (take_id, taken_ns, publication_id, start_ns) "
        "VALUES (1, 10, 1, 11), (2, 20, 2, 21), (3, 30, 3, 31)"
    )
    rules.execute("INSERT INTO link_causal_polled VALUES (1, 1, 4, 1, false), (1, 2, 5, 1, true)")
    rules.execute(
        "INSERT INTO store.publication (publication_id, is_loss_affected) "
        "VALUES (1, false), (2, true), (3, false)"
    )
    found = rules.execute(
        "SELECT publication_id, is_loss_affected FROM derive.link_causal_by_hand(1) ORDER BY ALL"
    ).fetchall()
    assert found == [(1, False), (2, True), (3, True), (4, False), (5, True)]


def test_lost_events_spoil_what_annotations_tell(rules: duckdb.DuckDBPyConnection) -> None:
    """Each link has the take of the instance that kept the message."""
    rules.execute(
        "INSERT INTO store.callback_instance (callback_instance_id, take_id, is_loss_affected) "
        "VALUES (1, 1, false), (2, 2, true)"
    )
    rules.execute(
        "INSERT INTO store.publication (publication_id, is_loss_affected) "
        "VALUES (1, false), (2, true), (3, false), (4, false)"
    )
    rules.execute(
        "INSERT INTO link_causal_indirect (callback_instance_id, publication_id, is_loss_affected) "
        "VALUES (1, 1, false), (1, 2, false), (2, 3, false), (1, 4, true)"
    )
    found = rules.execute(
        "SELECT publication_id, take_id, kind, annotation_id, candidate_count, is_loss_affected "
        "FROM derive.link_causal_annotated(1) ORDER BY ALL"
    ).fetchall()
    assert found == [
        (1, 1, "partial_sync", 7, 2, False),
        (2, 1, "partial_sync", 7, 2, True),
        (3, 2, "partial_sync", 7, 2, True),
        (4, 1, "partial_sync", 7, 2, True),
    ]
