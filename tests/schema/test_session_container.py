"""The container of each session, computed from compared pairs of sessions."""

from __future__ import annotations

import duckdb
import pytest

from msgflow.ingest.overlapping_traces import statements

SAME, OTHER = True, False
# (one session, a later one) -> whether they recorded the same threads.
Pairs = dict[tuple[int, int], bool]


def containers(pairs: Pairs) -> dict[int, int]:
    """Return the container of each session that is not of the first one of its host."""
    rows = [(left, right, is_same) for (left, right), is_same in pairs.items()]
    with duckdb.connect(config={"threads": 1}) as con:
        con.execute(
            "CREATE TABLE session_pair (left_session BIGINT, right_session BIGINT, is_same BOOLEAN)"
        )
        con.executemany("INSERT INTO session_pair VALUES (?, ?, ?)", rows)
        return dict(con.execute(statements().header("session_container").body).fetchall())


def test_a_session_of_other_threads_is_of_another_container() -> None:
    assert containers({(1, 2): OTHER, (1, 3): SAME, (2, 3): OTHER}) == {2: 2}


@pytest.mark.parametrize("middle", [3, 4, 5])
def test_sessions_that_a_third_one_joins_are_of_one_container(middle: int) -> None:
    """Two of them were not recorded at the same time, so no pair compares them."""
    first, second = (session for session in (3, 4, 5) if session != middle)
    joined = {(min(middle, session), max(middle, session)): SAME for session in (first, second)}
    against_the_first: Pairs = {(1, session): OTHER for session in (3, 4, 5)}
    assert containers({**against_the_first, **joined}) == {3: 3, 4: 3, 5: 3}


@pytest.mark.parametrize("compared", [2, 3, 4])
def test_one_session_that_differs_moves_its_whole_container(compared: int) -> None:
    assert containers({(1, compared): OTHER, (2, 3): SAME, (3, 4): SAME}) == {2: 2, 3: 2, 4: 2}


def test_sessions_of_the_first_container_that_a_third_one_joins() -> None:
    """What joins two sessions counts, even if these two are different where they are compared."""
    assert containers({(1, 2): SAME, (2, 3): SAME, (1, 3): OTHER, (1, 4): OTHER}) == {4: 4}


def test_the_later_container_is_the_other_one() -> None:
    """The one whose first session is later, whichever of its sessions was compared."""
    assert containers({(1, 4): SAME, (2, 4): OTHER, (2, 3): SAME}) == {2: 2, 3: 2}


def test_sessions_that_nothing_compares_may_be_of_one_container() -> None:
    """Those of two hosts, for one."""
    assert containers({(1, 2): SAME, (3, 4): SAME}) == {}
