"""Whether two sessions recorded the same threads: events that they have in common."""

from __future__ import annotations

from collections.abc import Sequence

import duckdb
import pytest

from msgflow.ingest.overlapping_traces import statements

TWIN_NS = 10
# (session, thread, tracepoint, CPU), and when. Without a CPU: on CPU 0.
Events = dict[tuple[int, ...], Sequence[int]]


def pairs(events: Events) -> list[tuple[int, int, bool]]:
    """Return (one session, a later one, whether they recorded the same threads)."""
    rows = [(*(*key, 0)[:4], ts) for key, times in events.items() for ts in times]
    with duckdb.connect(config={"threads": 1}) as con:
        con.execute(
            "CREATE TABLE session_event AS "
            "SELECT unnest($session) AS session, unnest($thread) AS thread, "
            "unnest($tracepoint) AS tracepoint, unnest($cpu_id) AS cpu_id, "
            "unnest($ts_ns)::BIGINT AS ts_ns",
            dict(
                zip(
                    ("session", "thread", "tracepoint", "cpu_id", "ts_ns"),
                    (list(column) for column in zip(*rows, strict=True)),
                    strict=True,
                )
            ),
        )
        body = statements().header("session_pair").body
        return sorted(con.execute(body, {"twin_ns": TWIN_NS}).fetchall())


def on_one_thread(left: Sequence[int], right: Sequence[int]) -> list[tuple[int, int, bool]]:
    return pairs({(0, 1, 1): left, (1, 1, 1): right})


@pytest.mark.parametrize(
    ("right", "is_same"),
    [
        ([0, 1_500, 2_500, 3_000], True),
        ([0, 1_500, 2_500, 2_700, 3_000], True),
        ([0, 1_500, 2_500, 3_005], True),
        ([0, 1_500, 2_500, 2_985], False),
    ],
)
def test_half_of_the_events_have_a_twin(right: list[int], is_same: bool) -> None:
    """Of those of the session that has fewer."""
    assert on_one_thread([0, 1_000, 2_000, 3_000], right) == [(0, 1, is_same)]


@pytest.mark.parametrize("apart", [TWIN_NS, -TWIN_NS])
def test_a_single_event_and_its_twin(apart: int) -> None:
    assert on_one_thread([100], [100 + apart]) == [(0, 1, True)]


@pytest.mark.parametrize("apart", [2 * TWIN_NS + 1, -2 * TWIN_NS - 1])
def test_sessions_that_follow_each_other_are_no_pair(apart: int) -> None:
    assert on_one_thread([100], [100 + apart]) == []


def test_only_the_time_in_which_both_recorded_counts() -> None:
    """One lost events in it. Before, or behind, only that one recorded."""
    rare, dense = [8_000, 12_000], [8_000, 9_000, 10_000, 11_000, 12_000]
    before, behind = list(range(0, 8_000, 1_000)), list(range(13_000, 21_000, 1_000))
    for more in (before, behind):
        assert on_one_thread(sorted([*rare, *more]), dense) == [(0, 1, True)]
        assert on_one_thread(dense, sorted([*rare, *more])) == [(0, 1, True)]


def test_a_twin_is_of_the_same_thread_and_tracepoint() -> None:
    even, odd = [0, 1_000, 2_000], [500, 1_500, 2_500]
    for other in ((2, 1), (1, 2)):
        assert pairs({(0, 1, 1): even, (0, *other): odd, (1, 1, 1): odd, (1, *other): even}) == [
            (0, 1, False)
        ]


def test_a_twin_is_of_the_same_cpu() -> None:
    same = [0, 1_000, 2_000]
    assert pairs({(0, 1, 1, 0): same, (1, 1, 1, 1): same}) == [(0, 1, False)]


@pytest.mark.parametrize("other", [(2, 1), (1, 2)])
def test_what_only_one_recorded_does_not_count(other: tuple[int, int]) -> None:
    """Another thread, or tracepoint; or both recorded it, one after the other."""
    left, right = [0, 1_000, 2_000, 3_000], [0, 1_000, 2_500, 2_900]
    alone: Events = {(0, 1, 1): left, (1, 1, 1): right, (1, *other): [2_000, 3_500]}
    assert pairs(alone) == [(0, 1, True)]
    same = [0, 1_000, 2_000]
    before, behind = [100, 200, 300, 400], [1_100, 1_200, 1_300, 1_400]
    apart: Events = {(0, 1, 1): same, (1, 1, 1): same, (0, *other): before, (1, *other): behind}
    assert pairs(apart) == [(0, 1, True)]


def test_each_thread_and_tracepoint_has_its_own_number_of_events() -> None:
    few = [1_000, 2_000]
    many = [*range(1_000, 2_000, 40), 2_000]
    for other in ((2, 1), (1, 2)):
        assert pairs({(0, 1, 1): few, (1, 1, 1): many, (0, *other): many, (1, *other): few}) == [
            (0, 1, True)
        ]


def test_each_pair_is_judged_by_itself() -> None:
    """Of three sessions, two recorded the same thread, at times without an event of the third."""
    same, other = [0, 1_000, 2_000], [500, 1_500, 2_500]
    events: Events = {(0, 1, 1): same, (1, 1, 1): other, (2, 1, 1): same}
    assert pairs(events) == [(0, 1, False), (0, 2, True), (1, 2, False)]


def test_each_pair_has_its_own_number_of_events() -> None:
    """The last session recorded more while the second did than while the first did."""
    events: Events = {
        (0, 1, 1): [0, 500, 1_000, 1_500, 2_000, 2_500, 2_900, 3_000],
        (1, 1, 1): [0, 9_000],
        (2, 1, 1): [0, 1_000, 1_700, 2_700, *range(4_000, 10_000, 1_000)],
    }
    assert pairs(events) == [(0, 1, True), (0, 2, True), (1, 2, True)]
