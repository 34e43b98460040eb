"""What pages show is what the views and named queries say."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import astuple
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.tables import decoded
from support.thorough import thorough

from msgflow.sql.statement import Statements
from msgflow.view.page_query import DIRECTORY, Question, page_query, run_page_query
from msgflow.view.pages import LEVEL_BINS, Pages

PAGES = Statements(DIRECTORY)
NAMES = PAGES.names()
OVER_SCRATCH = {"level", "path_histogram", "path_point", "path_share", "path_slowest"}
Read = Callable[[Path], duckdb.DuckDBPyConnection]


def values(connection: duckdb.DuckDBPyConnection, run: int | None = None) -> Any:
    return Question(connection, {} if run is None else {"run": str(run)}).frame()


@pytest.mark.parametrize("name", NAMES)
def test_headers_say_what_a_page_query_has(name: str, demo: Path, read: Read) -> None:
    header = page_query(name)
    assert header.name == name
    if header.kind == "inline" or name in OVER_SCRATCH:
        return
    connection = read(demo)
    named = connection.extract_statements(PAGES.text(name))[0].named_parameters
    often = {"run", "start_ns", "end_ns", "origin_ns"}
    assert named | often == {param.name for param in header.params} | often
    given = (
        dict.fromkeys(named, 1) | {"kind": "take"} if "kind" in named else dict.fromkeys(named, 1)
    )
    if name == "neighbour":
        given["kind"] = 1
    if "direction" in named:
        given["direction"] = "both"
    table = run_page_query(connection, name, given)
    assert table.column_names == [column.name for column in header.columns]


def test_numbers_of_rows_and_pieces_have_bounds() -> None:
    """A page may ask for any: a large one would take all memory, a negative one is an error."""
    params = [(name, param) for name in NAMES for param in page_query(name).params]
    sizes = [(name, param) for name, param in params if param.name in ("bins", "limit", "steps")]
    assert len(sizes) > 10
    assert [name for name, param in sizes if param.minimum != 1 or param.maximum is None] == []


def test_bars_are_the_instances_of_the_views(demo: Path, read: Read) -> None:
    connection = read(demo)
    bars = run_page_query(connection, "segments", values(connection))
    connection.register("bars", bars)
    ((origin,),) = connection.execute("SELECT start_ns FROM run").fetchall()
    for kind, sql in enumerate(
        (
            "SELECT callback_instance_id, start_ns, coalesce(end_ns, start_ns)"
            " FROM callback_instance",
            "SELECT publication_id, start_ns, end_ns FROM publication",
            "SELECT take_id, taken_ns, taken_ns FROM take",
            "SELECT request_id, coalesce(sent_ns, taken_ns), coalesce(taken_ns, sent_ns)"
            " FROM request",
            "SELECT response_id, coalesce(sent_ns, taken_ns), coalesce(taken_ns, sent_ns)"
            " FROM response",
        )
    ):
        drawn = (
            f"SELECT id, start_at + {origin}, start_at + length + {origin}"
            f" FROM bars WHERE kind = {kind}"
        )
        assert connection.execute(f"({sql}) EXCEPT ALL ({drawn})").fetchall() == []
        assert connection.execute(f"({drawn}) EXCEPT ALL ({sql})").fetchall() == []


@pytest.mark.thorough
def test_lanes_of_executors_are_what_their_threads_did(
    simulated: Callable[..., Path], read: Read
) -> None:
    connection = read(simulated("multi_threaded", 0.3))
    bars = run_page_query(connection, "segments", values(connection))
    connection.register("bars", bars)
    ((origin,),) = connection.execute("SELECT start_ns FROM run").fetchall()
    for kind, sql in (
        (5, "SELECT * EXCLUDE state FROM did WHERE state = 'wait'"),
        (
            9,
            "SELECT thread_id, start_ns, end_ns - start_ns FROM executor_activity"
            " WHERE activity = 'blocked' AND end_ns IS NOT NULL",
        ),
    ):
        did = (
            "WITH did AS (SELECT state, thread_id, start_ns, coalesce(end_ns, start_ns) - start_ns"
            " FROM executor_state)"
        )
        wanted = connection.execute(f"{did} {sql} ORDER BY ALL").fetchall()
        drawn = connection.execute(
            f"SELECT (row_key - 6) // 8, start_at + {origin}, length FROM bars"
            f" WHERE kind = {kind} ORDER BY ALL"
        ).fetchall()
        assert len(drawn) > 20
        assert drawn == wanted
    # What a thread did in a state is one bar or two, together as long.
    assert (
        connection.execute(
            "SELECT thread_id, sum(end_ns - start_ns) FROM executor_state GROUP BY 1 ORDER BY 1"
        ).fetchall()
        == connection.execute(
            "SELECT (row_key - 6) // 8, sum(length) FROM bars WHERE kind IN (5, 6, 7, 9)"
            " GROUP BY 1 ORDER BY 1"
        ).fetchall()
    )


@pytest.mark.parametrize(
    ("name", "run"), [("demo", 1), thorough("systems", 1), thorough("systems", 2)]
)
def test_every_bar_has_a_row(
    name: str, run: int, request: pytest.FixtureRequest, read: Read
) -> None:
    connection = read(request.getfixturevalue(name))
    known = values(connection, run)
    bars = run_page_query(connection, "segments", known)
    rows = run_page_query(connection, "row", {"run": run})
    keys = rows["row_key"].to_pylist()
    assert len(set(keys)) == len(keys)
    assert set(bars["row_key"].to_pylist()) <= set(keys)


def test_a_window_has_the_bars_that_overlap_it(demo: Path, read: Read) -> None:
    connection = read(demo)
    whole = run_page_query(connection, "segments", values(connection)).to_pylist()
    window = {"start": 700_000_000, "end": 900_000_000}
    known = Question(connection, window).frame()
    part = run_page_query(connection, "segments", known).to_pylist()
    wanted = [
        bar
        for bar in whole
        if bar["start_at"] < window["end"] and bar["start_at"] + bar["length"] >= window["start"]
    ]
    assert part == wanted
    assert 0 < len(part) < len(whole)
    # One that began before the window and lasts into it.
    assert any(bar["start_at"] < window["start"] for bar in part)


def test_bins_lose_nothing(demo: Path, read: Read) -> None:
    connection = read(demo)
    known = values(connection)
    single = run_page_query(connection, "segments", known)
    bin_ns = 5_000_000
    binned = run_page_query(connection, "segments", known | {"bin_ns": bin_ns})
    assert binned.num_rows < single.num_rows
    connection.register("single", single)
    connection.register("binned", binned)
    totals = (
        "SELECT row_key, kind, sum(count)::BIGINT, sum(busy)::BIGINT FROM {}"
        " GROUP BY ALL ORDER BY ALL"
    )
    assert (
        connection.execute(totals.format("single")).fetchall()
        == connection.execute(totals.format("binned")).fetchall()
    )
    long = (
        "SELECT row_key, kind, id, start_at FROM {}"
        " WHERE length >= 5000000 AND id IS NOT NULL ORDER BY ALL"
    )
    assert (
        connection.execute(long.format("single")).fetchall()
        == connection.execute(long.format("binned")).fetchall()
    )
    ((wrong,),) = connection.execute(
        "SELECT count(*) FROM binned"
        " WHERE id IS NULL AND (start_at % 5000000 <> 0 OR length <> 5000000)"
    ).fetchall()
    assert wrong == 0


def test_a_level_put_together_says_the_same_as_bins_made_at_once(
    demo: Path, read: Read, monkeypatch: pytest.MonkeyPatch
) -> None:
    connection = read(demo)
    monkeypatch.setattr("msgflow.view.pages.MOST_BARS", 1)
    pages = Pages()
    content = decoded(pages.answer(connection, "segments", {}))
    bin_ns = content.meta["bin"]
    level_ns = Question(connection, {}).length_ns // LEVEL_BINS + 1
    assert bin_ns % level_ns == 0
    assert bin_ns > level_ns
    direct = run_page_query(
        connection, "segments", values(connection) | {"bin_ns": bin_ns}
    ).to_pylist()
    assert content.meta["count"] == sum(bar["count"] for bar in direct)
    assert content.rows == [{**bar, "id": bar["id"]} for bar in direct]


@pytest.mark.thorough
def test_a_flow_is_what_flow_both_says(systems: Path, demo: Path, read: Read) -> None:
    names = ["callback_instance", "publication", "take", "request", "response"]
    for path, run in ((systems, 1), (systems, 3), (demo, 1)):
        connection = read(path)
        pages = Pages()
        for kind in names:
            found = connection.execute(
                f"SELECT {kind}_id FROM main.{kind} WHERE run_id = {run} ORDER BY 1"
            ).fetchall()
            for (number,) in found[len(found) // 3 :: max(len(found) // 3, 1)][:2]:
                content = decoded(
                    pages.answer(connection, "flow", {"run": run, "kind": kind, "id": number})
                )
                drawn = {(names[row["kind"]], row["id"]) for row in content.rows}
                wanted = set(
                    connection.execute(
                        f"SELECT kind, id FROM flow_both('{kind}', {number})"
                    ).fetchall()
                )
                assert drawn == wanted
                assert content.rows[0]["vertex_count"] == len(wanted)
                links = {
                    (
                        names[row["from_kind"]],
                        row["from_id"],
                        names[row["kind"]],
                        row["id"],
                        row["link_kind"],
                    )
                    for row in content.rows
                    if row["from_kind"] is not None
                }
                connection.execute("CREATE OR REPLACE TEMP TABLE vertex (kind VARCHAR, id BIGINT)")
                connection.executemany("INSERT INTO vertex VALUES (?, ?)", sorted(wanted))
                assert links == set(
                    connection.execute(
                        "SELECT from_kind, from_id, to_kind, to_id, link_kind FROM flow_edge"
                        " SEMI JOIN vertex AS f ON from_kind = f.kind AND from_id = f.id"
                        " SEMI JOIN vertex AS t ON to_kind = t.kind AND to_id = t.id"
                    ).fetchall()
                )


@pytest.mark.thorough
def test_arrows_are_the_links(systems: Path, read: Read) -> None:
    connection = read(systems)
    arrows = Question(connection, {"run": "3"}).links(10**6).to_pylist()
    transport = connection.execute(
        "SELECT count(*), sum(latency_ns) FROM link_transport WHERE run_id = 3"
    ).fetchall()
    messages = [arrow for arrow in arrows if arrow["link_kind"] == 0]
    assert [(len(messages), sum(one["to_at"] - one["from_at"] for one in messages))] == transport
    codes = ["transport", "direct", "periodic_async", "partial_sync", "take_adjacent", "polled"]
    causes = dict(
        connection.execute(
            "SELECT kind, count(*) FROM link_causal WHERE run_id = 3 GROUP BY kind"
        ).fetchall()
    )
    for code, kind in enumerate(codes[1:], start=1):
        assert len([one for one in arrows if one["link_kind"] == code]) == causes.get(kind, 0)
    assert causes["periodic_async"]
    assert causes["partial_sync"]
    waits = sum(one["to_at"] - one["from_at"] for one in arrows if one["link_kind"] in (2, 3))
    ((wanted,),) = connection.execute(
        "SELECT sum(wait_ns) FROM link_causal"
        " WHERE run_id = 3 AND kind IN ('periodic_async', 'partial_sync')"
    ).fetchall()
    assert waits == wanted


@pytest.mark.thorough
def test_arrows_of_a_window_are_those_that_overlap_it(demo: Path, read: Read) -> None:
    """On two hosts whose clocks were brought together."""
    connection = read(demo)
    whole = Question(connection, {})
    arrows = whole.links(10**6).to_pylist()
    for width in (whole.length_ns // 10, whole.length_ns // 1000, 20_000):
        for tenth in range(0, 11, 2):
            start = tenth * whole.length_ns // 10 - width // 2
            asked = Question(connection, {"start": start, "end": start + width})
            found = asked.links(10**6).to_pylist()
            begin, end = (at - whole.origin_ns for at in astuple(asked.window))
            assert found == [
                arrow
                for arrow in arrows
                if min(arrow["from_at"], arrow["to_at"]) < end
                and max(arrow["from_at"], arrow["to_at"]) >= begin
            ]


@pytest.mark.thorough
def test_arrows_of_a_window_do_not_take_memory_for_what_is_far_from_it(
    systems: Path, read: Read
) -> None:
    connection = read(systems)
    length_ns = Question(connection, {"run": "3"}).length_ns
    window = {"start": length_ns // 2, "end": length_ns // 2 + length_ns // 100}
    known = Question(connection, {"run": "3", **window}).frame() | {"limit": 10**6}
    known |= run_page_query(connection, "window_ids", known).to_pylist()[0]
    sql = PAGES.text("links")
    named = connection.extract_statements(sql)[0].named_parameters
    rows = connection.execute(
        f"EXPLAIN (ANALYZE, FORMAT json) {sql}", {name: known[name] for name in named}
    ).fetchall()
    held: list[int] = []

    def look(operator: Any) -> None:
        children = operator.get("children", [])
        if operator["type"] == "HASH_JOIN":
            held.append(children[1]["intermediate_rows"])
        for child in children:
            look(child)

    (plan,) = json.loads(rows[0][1])["operator"]
    look(plan)
    ((all_of_them,),) = connection.execute(
        "SELECT count(*) FROM publication WHERE run_id = 3"
    ).fetchall()
    assert held
    # Two joins are of what was published before the last subscription was created: it may be
    # stored (main.link_transport).
    assert sorted(held)[-3] < all_of_them / 10


def test_what_a_finding_says_of_clocks_is_not_said_below_it_too(
    simulated: Callable[..., Path], demo: Path, read: Read
) -> None:
    for path, said in ((simulated("demo", 0.3), False), (demo, True)):
        found = decoded(Pages().answer(read(path), "finding", {"run": "1"}))
        names = {row["name"] for row in found.rows}
        assert bool(names & {"clocks_apart", "clocks_not_together"}) != said
        assert bool(found.meta["notes"]) == said


@pytest.fixture
def apart(simulated: Callable[..., Path]) -> Path:
    """The robot on two hosts, as recorded: each of its paths passes both."""
    return simulated("demo", 0.3)


@pytest.mark.parametrize(
    ("name", "run", "comparable"),
    [("apart", 1, {False}), thorough("systems", 3, {True, False})],
)
def test_paths_whose_hosts_have_clocks_that_are_apart_are_known(
    name: str,
    run: int,
    comparable: set[bool],
    request: pytest.FixtureRequest,
    demo: Path,
    read: Read,
) -> None:
    together = run_page_query(read(demo), "path", {"run": 1}).to_pylist()
    assert {path["is_comparable"] for path in together} == {True}
    connection = read(request.getfixturevalue(name))
    found = run_page_query(connection, "path", {"run": run}).to_pylist()
    host_of = {
        table: dict(
            connection.execute(
                f"SELECT {table}_id, host_id FROM {table} JOIN process USING (process_id)"
            ).fetchall()
        )
        for table in ("publisher", "subscription")
    }
    for path in found:
        hosts = {host_of["publisher"][one] for one in path["publishers"]}
        hosts |= {host_of["subscription"][one] for one in path["subscriptions"]}
        assert path["is_comparable"] == (len(hosts) == 1)
    assert {path["is_comparable"] for path in found} == comparable


def test_flows_of_paths_are_those_that_e2e_latency_counts(demo: Path, read: Read) -> None:
    connection = read(demo)
    pages = Pages()
    latency = decoded(pages.answer(connection, "query", {"name": "e2e-latency"})).rows
    paths = decoded(pages.answer(connection, "path", {})).rows
    assert [row["path"] for row in paths] == sorted(row["path"] for row in latency)
    for row in latency:
        (number,) = [path["path_id"] for path in paths if path["path"] == row["path"]]
        histogram = decoded(pages.answer(connection, "path_histogram", {"path": number})).rows
        assert sum(one["count"] for one in histogram) == row["reached"]
        assert histogram[0]["low"] == row["min_ns"]
        last = histogram[-1]
        assert last["low"] <= row["max_ns"] < last["low"] + last["width"]
        shares = decoded(pages.answer(connection, "path_share", {"path": number})).rows
        assert shares[-1] == {"share": 1.0, "latency": row["max_ns"]}
        half = next(one["latency"] for one in shares if one["share"] >= 0.5)
        assert abs(half - row["median_ns"]) <= (row["max_ns"] - row["min_ns"]) / 10
        points = decoded(pages.answer(connection, "path_point", {"path": number})).rows
        assert len(points) == row["roots"]
        assert max(one["latency"] or 0 for one in points) == row["max_ns"]
        assert sum(one["missing"] for one in points) == (
            row["roots"] - row["reached"] - row["not_connected"] - row["cut_by_recording"]
        )
        few = decoded(pages.answer(connection, "path_point", {"path": number, "limit": 7})).rows
        assert len(few) <= 7
        assert sum(one["count"] for one in few) == row["roots"]
        assert max(one["latency"] or 0 for one in few) == row["max_ns"]
        slowest = decoded(pages.answer(connection, "path_slowest", {"path": number})).rows
        assert [one["latency"] for one in slowest] == sorted(
            (one["latency"] for one in points if one["latency"] is not None), reverse=True
        )[:10]


@pytest.mark.thorough
def test_executors_over_time_add_up(simulated: Callable[..., Path], read: Read) -> None:
    connection = read(simulated("multi_threaded", 0.3))
    pages = Pages()
    shares = decoded(pages.answer(connection, "executor_share", {})).rows
    wanted = connection.execute(
        "SELECT CASE WHEN activity IN ('take', 'service') THEN 'callback' ELSE activity END,"
        " sum(end_ns - start_ns) FROM executor_activity WHERE end_ns IS NOT NULL GROUP BY 1"
    ).fetchall()
    assert {name for name, _ in wanted} == {"wait", "select", "callback", "blocked"}
    for activity, length in wanted:
        assert sum(row["busy"] for row in shares if row["activity"] == activity) == length
    assert all(0 <= row["busy"] <= row["length"] for row in shares)


def test_the_next_of_a_row(demo: Path, read: Read) -> None:
    connection = read(demo)
    pages = Pages()
    ((publisher, count),) = connection.execute(
        "SELECT publisher_id, count(*) FROM publication JOIN publisher USING (publisher_id)"
        " WHERE topic_name = '/camera/image' GROUP BY publisher_id"
    ).fetchall()
    order = [
        number
        for (number,) in connection.execute(
            "SELECT publication_id FROM publication WHERE publisher_id = ? ORDER BY start_ns",
            [publisher],
        ).fetchall()
    ]
    assert len(order) == count

    def beside(number: int, step: int) -> list[int]:
        found = decoded(
            pages.answer(
                connection,
                "neighbour",
                {"row": 8 * publisher + 4, "kind": 1, "id": number, "step": step},
            )
        )
        return [row["id"] for row in found.rows]

    assert beside(order[3], 1) == [order[4]]
    assert beside(order[3], -1) == [order[2]]
    assert beside(order[0], -1) == []
    assert beside(order[-1], 1) == []
