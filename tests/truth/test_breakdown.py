"""The parts of flows, and the pieces of critical paths, against the latencies they come from."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import duckdb
import pytest
from support.ingested import Ingested
from support.thorough import few

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow_sim import scenarios

WINDOW = "-9223372036854775807, 9223372036854775807"
RECORDINGS = [
    "sync_1_1",
    "sync_1_1_humble",
    "sync_1_1_jazzy",
    "pingpong",
    "services",
    "periodic_async_jazzy24",
    "partial_sync",
    "tracecompass-ros2",
    "real_overload",
]
# What is wrong with a flow: its parts do not follow each other from its start to its end, or do
# not add up to its latency; a flow without parts, or parts without a flow.
WRONG_FLOWS = """
    WITH flow AS (
        SELECT path_id, root_kind, root_id, take_id, root_ns, sink_ns
        FROM end_to_end([1], NULL, NULL, '{begin}', '{end}', {window})
        WHERE latency_ns IS NOT NULL AND CASE '{case}' WHEN 'first' THEN is_first ELSE true END
    ),
    part AS (
        SELECT
            *, lead(from_ns) OVER (PARTITION BY flow_id ORDER BY position) AS next_ns
        FROM end_to_end_part([1], NULL, NULL, '{begin}', '{end}', {window}, '{case}')
    ),
    whole AS (
        SELECT
            path_id, root_kind, root_id, take_id,
            count(DISTINCT flow_id) AS flows,
            arg_min(from_ns, position) AS from_ns,
            arg_max(to_ns, position) AS to_ns,
            sum(duration_ns) AS total_ns,
            bool_and(next_ns IS NULL OR next_ns = to_ns) AS is_connected,
            max(position) = count(*) AS is_numbered
        FROM part
        GROUP BY ALL
    )
    SELECT * FROM flow FULL JOIN whole USING (path_id, root_kind, root_id, take_id)
    WHERE (
        flows = 1 AND from_ns = root_ns AND to_ns = sink_ns AND total_ns = sink_ns - root_ns
        AND is_connected AND is_numbered
    ) IS NOT TRUE
"""


def check_flows(ingested: Ingested) -> int:
    """Return the number of flows that are right; fail on any that is not."""
    for begin, end, case in (
        ("callback_start", "callback_end", "every_pair"),
        ("publish", "take", "every_pair"),
        ("callback_start", "callback_start", "first"),
    ):
        wrong = WRONG_FLOWS.format(begin=begin, end=end, case=case, window=WINDOW)
        assert ingested.rows(f"{wrong} LIMIT 3") == []
    (row,) = ingested.rows(
        "SELECT count(*) FROM end_to_end([1], NULL, NULL, 'callback_start', 'callback_end', "
        f"{WINDOW}) WHERE latency_ns IS NOT NULL"
    )
    count: int = row[0]
    return count


@pytest.mark.thorough
@pytest.mark.parametrize("name", RECORDINGS)
def test_parts_of_recorded_flows_add_up(recordings: Callable[[str], Ingested], name: str) -> None:
    assert check_flows(recordings(name)) > 0


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(scenarios(), "services"))
def test_parts_of_simulated_flows_add_up(simulations: Callable[[str], Ingested], name: str) -> None:
    check_flows(simulations(name))


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(RECORDINGS, "services"))
def test_the_breakdown_adds_up_by_path(recordings: Callable[[str], Ingested], name: str) -> None:
    """Sums of the query over the parts of a path are those of its flows, from start to end."""
    con = recordings(name).connection
    rows = run_query(con, load_query("path-breakdown"), {}).to_arrow().to_pylist()
    totals: dict[int, int] = {}
    for row in rows:
        totals[row["path_id"]] = totals.get(row["path_id"], 0) + row["total_ns"]
    expected = con.execute(
        "SELECT path_id, sum(latency_ns)::BIGINT FROM end_to_end([1], NULL, NULL, "
        f"'callback_start', 'callback_end', {WINDOW}) "
        "WHERE latency_ns IS NOT NULL AND is_first GROUP BY path_id"
    ).fetchall()
    assert totals == dict(expected)


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(RECORDINGS, "periodic_async_jazzy24"))
def test_pieces_of_the_critical_path_add_up(
    recordings: Callable[[str], Ingested], name: str
) -> None:
    """Of the longest flow of all, and of those that end with some other takes."""
    con = recordings(name).connection
    arguments = f"[1], NULL, NULL, 'callback_start', 'callback_end', {WINDOW}"
    longest = con.execute(
        f"SELECT max(latency_ns) FROM end_to_end({arguments}) WHERE is_first"
    ).fetchall()[0][0]
    takes = con.execute(
        f"SELECT DISTINCT take_id FROM end_to_end({arguments}) WHERE status = 'reached' ORDER BY 1"
    ).fetchall()
    for take_id in (None, *(take for (take,) in takes[:: len(takes) // 3 + 1])):
        pieces = con.execute(
            f"SELECT part, latency_ns, from_ns, to_ns, duration_ns, take_id FROM "
            f"critical_path({arguments}, sink_take_id := ?) ORDER BY position",
            [take_id],
        ).fetchall()
        assert sum(duration for *_, duration, _ in pieces) == pieces[0][1]
        for before, after in pairwise(pieces):
            assert before[3] == after[2]
        assert {piece[5] for piece in pieces} == {take_id or pieces[0][5]}
        if take_id is None:
            assert pieces[0][1] == longest


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name", few(["tracecompass-ros2", "services", "periodic_async_jazzy24"], "services")
)
def test_the_critical_path_and_the_breakdown_agree(
    recordings: Callable[[str], Ingested], name: str
) -> None:
    """Of the longest flow: what its executors were busy with, and what is not decided."""
    con = recordings(name).connection
    arguments = f"[1], NULL, NULL, 'callback_start', 'callback_end', {WINDOW}"
    ((take_id, from_piece, certain, doubtful, idle),) = con.execute(
        "SELECT any_value(take_id), sum(duration_ns), "
        "sum(CASE WHEN activity IN ('executor_busy', 'blocked') AND is_certain "
        "THEN duration_ns ELSE 0 END), "
        "sum(CASE WHEN activity = 'undecided' OR NOT is_certain THEN duration_ns ELSE 0 END), "
        "sum(CASE WHEN activity = 'network_or_idle' THEN duration_ns ELSE 0 END) "
        f"FROM critical_path({arguments}) WHERE part IN ('publish_to_take', 'request_to_take')"
    ).fetchall()
    ((whole, busy_min, busy_max),) = con.execute(
        "SELECT sum(duration_ns), sum(coalesce(busy_min_ns, 0)), "
        "sum(coalesce(busy_max_ns, duration_ns)) "
        f"FROM end_to_end_part({arguments}, 'first', sink_take_id := ?, most_flows := 1) "
        "LEFT JOIN executor_wait USING (callback_instance_id) "
        "WHERE part IN ('publish_to_take', 'request_to_take')",
        [take_id],
    ).fetchall()
    assert from_piece == whole == certain + doubtful + idle
    assert (certain, certain + doubtful) == (busy_min, busy_max)


@pytest.mark.thorough
def test_the_wait_for_a_timer_is_shown_as_such(recordings: Callable[[str], Ingested]) -> None:
    """Periods of 8 ms, inputs every 5 and 12: the longest flow waited for the timer."""
    (row,) = (
        recordings("periodic_async_jazzy24")
        .connection.execute(
            "SELECT sum(duration_ns) / any_value(latency_ns) FROM critical_path([1], NULL, NULL, "
            f"'callback_start', 'callback_end', {WINDOW}) WHERE activity = 'timer'"
        )
        .fetchall()
    )
    assert row[0] > 0.5


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name", few(["sync_1_1", "periodic_async_jazzy24", "partial_sync"], "periodic_async_jazzy24")
)
def test_maximum_reaction_time_is_maximum_data_age(
    recordings: Callable[[str], Ingested], name: str
) -> None:
    """They are equal where outputs keep the order of inputs (Günzel and others, ECRTS 2023).

    What happened before the first input that arrived has a reaction time, but no age.
    """
    con = recordings(name).connection
    first = con.execute(
        "SELECT path_id, path, min(root_ns) FROM end_to_end([1], NULL, NULL, 'callback_start', "
        f"'callback_end', {WINDOW}) JOIN flow_path([1], NULL, NULL) USING (path_id) "
        "WHERE status = 'reached' GROUP BY ALL ORDER BY 1"
    ).fetchall()
    ages = {row["path"]: row for row in measured(con, "e2e-latency-age")}
    assert set(ages) == {path for _, path, _ in first}
    for _, path, arrived_ns in first:
        reactions = {
            row["path"]: row for row in measured(con, "e2e-latency-reaction", arrived_ns + 1)
        }
        assert ages[path]["peak_max_ns"] == reactions[path]["max_ns"]


def measured(
    con: duckdb.DuckDBPyConnection, query: str, start: int | None = None
) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = (
        run_query(con, load_query(query), {}, Slice(start=start)).to_arrow().to_pylist()
    )
    return rows


@pytest.mark.thorough
@pytest.mark.parametrize("case", few(["first", "last", "newest", "every_pair"], "first"))
def test_the_slowest_flow_is_one_of_those_that_count(
    recordings: Callable[[str], Ingested], case: str
) -> None:
    con = recordings("periodic_async_jazzy24").connection
    (row,) = con.execute(
        "SELECT (SELECT max(latency_ns) FROM end_to_end_flow([1], flow_case := $case)), "
        "(SELECT any_value(latency_ns) FROM critical_path([1], flow_case := $case)), "
        "(SELECT max(latency_ns) FROM end_to_end_flow([1], flow_case := 'every_pair'))",
        {"case": case},
    ).fetchall()
    slowest, of_critical_path, of_all = row
    assert of_critical_path == slowest
    # A timer publishes some inputs twice: their first arrivals are earlier.
    assert (slowest < of_all) == (case == "first")
