"""Critical paths below callbacks, on recordings with kernel traces."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.ingested import Ingested, ingest_one
from support.thorough import few

RECORDED = ("pipeline", "mutex", "cond", "autoware", "nodump")


@pytest.fixture(scope="module", params=few(RECORDED, "mutex"))
def traced(
    request: pytest.FixtureRequest, shared_kernel: Path, tmp_path_factory: pytest.TempPathFactory
) -> Ingested:
    """A recording with the pieces of the critical paths of all its flows."""
    path = tmp_path_factory.mktemp(request.param) / "run.duckdb"
    ingested = ingest_one(shared_kernel / request.param / "trace-chrisnux", path)
    ingested.connection.execute(
        "CREATE TEMP TABLE piece AS FROM critical_path([1], most_flows := 1000)"
    )
    return ingested


@pytest.mark.thorough
def test_pieces_add_up_to_the_latency(traced: Ingested) -> None:
    assert (
        traced.rows(
            "WITH following AS (SELECT *, lead(from_ns) OVER flow AS next_ns FROM piece "
            "WINDOW flow AS (PARTITION BY flow_rank ORDER BY position)) "
            "SELECT flow_rank FROM following GROUP BY flow_rank "
            "HAVING sum(duration_ns) <> any_value(latency_ns) "
            "OR bool_or(next_ns <> to_ns) OR max(position) <> count(*)"
        )
        == []
    )
    assert traced.rows("SELECT count(DISTINCT flow_rank) > 100 FROM piece") == [(True,)]


@pytest.mark.thorough
def test_whole_callbacks_agree_with_their_schedule(traced: Ingested) -> None:
    """What is not a wait for another thread is the same as in the sums of the callback."""
    assert traced.rows("""
        WITH callback AS (
            SELECT
                callback_instance_id, flow_rank,
                sum(duration_ns) AS duration_ns,
                coalesce(sum(duration_ns) FILTER (WHERE state = 'running' AND wakers = 0), 0)
                    AS running_ns,
                coalesce(sum(duration_ns) FILTER (WHERE state = 'preempted' AND wakers = 0), 0)
                    AS preempted_ns,
                coalesce(sum(duration_ns) FILTER (
                    WHERE state IN ('sleeping', 'uninterruptible') OR wakers > 0
                ), 0) AS waited_ns
            FROM piece
            WHERE activity = 'callback' AND part = 'callback'
            GROUP BY ALL
        )
        SELECT
            count(*) > 100,
            count(*) FILTER (
                WHERE c.running_ns <> s.running_ns OR c.preempted_ns <> s.preempted_ns
                OR c.waited_ns <> s.sleeping_ns + s.uninterruptible_ns
            )
        FROM callback AS c
        JOIN callback_schedule AS s USING (callback_instance_id)
        JOIN callback_instance AS i USING (callback_instance_id)
        WHERE c.duration_ns = i.end_ns - i.start_ns
    """) == [(True, 0)]


def test_wakers_are_followed_to_threads_that_ran(traced: Ingested) -> None:
    """A thread that woke another one had a CPU: with all wakers known, the chain says whose."""
    assert traced.rows(
        "SELECT count(*) FROM piece WHERE wakers > 0 AND (state IS NULL OR state_thread_id IS NULL)"
    ) == [(0,)]
    assert traced.rows(
        "SELECT count(*) FROM piece WHERE state IN ('sleeping', 'uninterruptible') "
        "AND by_thread_id IS NOT NULL AND by_thread_id IN (SELECT thread_id FROM thread_state "
        "WHERE start_ns <= piece.from_ns AND end_ns >= piece.to_ns)"
    ) == [(0,)]
