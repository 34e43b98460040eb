"""The walker behind all flows, on any graph: recursion ends, and directions agree."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any

import duckdb
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.analysis import Analysis
from support.thorough import examples

from msgflow.db import objects

Edges = list[tuple[int, int]]
VERTICES = st.integers(1, 8)
EDGES = st.lists(st.tuples(VERTICES, VERTICES), max_size=20)
EXAMPLES = settings(
    max_examples=40,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


@pytest.fixture(scope="module")
def walker() -> duckdb.DuckDBPyConnection:
    """A database with the walker and a table `edge`, nothing else."""
    con = duckdb.connect()
    con.execute("SET threads = 1")
    con.execute("CREATE SCHEMA derive")
    (header,) = (h for h in objects.load("flow") if h.name == "derive.graph_reachable")
    con.execute(header.body)
    con.execute(
        "CREATE TABLE edge (from_kind VARCHAR, from_id BIGINT, to_kind VARCHAR, to_id BIGINT)"
    )
    return con


def reachable(
    con: duckdb.DuckDBPyConnection, edges: Edges, start: int, max_depth: int | None = None
) -> list[int]:
    """Vertices that the walker finds; kinds alternate, so that they have to be compared."""
    con.execute("DELETE FROM edge")
    for origin, target in edges:
        con.execute(
            "INSERT INTO edge VALUES (?, ?, ?, ?)", [kind(origin), origin, kind(target), target]
        )
    found = con.execute(
        "SELECT kind, id FROM derive.graph_reachable('edge', $kind, $id, max_depth := $depth) "
        "ORDER BY id",
        {"kind": kind(start), "id": start, "depth": max_depth},
    ).fetchall()
    assert all(name == kind(vertex) for name, vertex in found)
    return [vertex for _, vertex in found]


def kind(vertex: int) -> str:
    return "take" if vertex % 2 else "publication"


def expected(edges: Iterable[tuple[int, int]], start: int, max_depth: int = 1_000) -> list[int]:
    depth = {start: 0}
    queue = deque([start])
    edges = list(edges)
    while queue:
        vertex = queue.popleft()
        for origin, target in edges:
            if origin == vertex and target not in depth and depth[vertex] < max_depth:
                depth[target] = depth[vertex] + 1
                queue.append(target)
    return sorted(depth)


@pytest.mark.parametrize(
    "edges",
    [
        [],
        [(1, 1)],
        [(1, 2), (2, 1)],
        [(1, 2), (2, 3), (3, 4), (4, 2)],
        [(1, 2), (1, 3), (2, 4), (3, 5), (5, 4), (4, 6)],
        [(2, 1), (3, 4)],
    ],
    ids=["nothing", "loop", "cycle", "cycle behind", "diamond", "elsewhere"],
)
def test_each_vertex_comes_once(walker: duckdb.DuckDBPyConnection, edges: Edges) -> None:
    assert reachable(walker, edges, 1) == expected(edges, 1)
    assert reachable(walker, edges, 1, max_depth=1_000_000) == expected(edges, 1)


@pytest.mark.parametrize("max_depth", [0, 1, 2, 3])
def test_steps_may_be_limited(walker: duckdb.DuckDBPyConnection, max_depth: int) -> None:
    """The shortest way counts, and a limit below a cycle does not matter to others."""
    edges = [(1, 2), (2, 1), (2, 3), (1, 4), (4, 5), (5, 3), (3, 6)]
    assert reachable(walker, edges, 1, max_depth) == expected(edges, 1, max_depth)


@EXAMPLES
@given(edges=EDGES, start=VERTICES, max_depth=st.none() | st.integers(0, 9))
def test_on_any_graph(
    walker: duckdb.DuckDBPyConnection, edges: Edges, start: int, max_depth: int | None
) -> None:
    limit = 1_000 if max_depth is None else max_depth
    assert reachable(walker, edges, start, max_depth) == expected(edges, start, limit)


def test_a_long_cycle_costs_no_more_than_its_length(walker: duckdb.DuckDBPyConnection) -> None:
    walker.execute("DELETE FROM edge")
    walker.execute(
        "INSERT INTO edge SELECT 'take', n, 'take', (n + 1) % 500 FROM range(500) AS r(n)"
    )
    assert walker.execute(
        "SELECT count(*) FROM derive.graph_reachable('edge', 'take', 0)"
    ).fetchall() == [(500,)]


# Links of any shape, as no trace would have them: run 1 with takes, publications, callback runs,
# requests and responses 1 to 4, each callback run with at most one take and one request.
LINKS = st.fixed_dictionaries(
    {
        "transport": st.lists(st.tuples(st.integers(1, 4), st.integers(1, 4)), max_size=6),
        "causal": st.lists(st.tuples(st.integers(1, 4), st.integers(1, 4)), max_size=6),
        "taken": st.lists(st.none() | st.integers(1, 4), min_size=4, max_size=4),
        "requested": st.lists(st.tuples(st.integers(1, 4), st.integers(1, 4)), max_size=4),
        "called": st.lists(st.none() | st.integers(1, 4), min_size=4, max_size=4),
        "answered": st.lists(st.tuples(st.integers(1, 4), st.integers(1, 4)), max_size=4),
        "replied": st.lists(st.none() | st.integers(1, 4), min_size=4, max_size=4),
    }
)
KINDS = ("publication", "take", "callback_instance", "request", "response")


def store_links(con: duckdb.DuckDBPyConnection, links: dict[str, list[Any]]) -> None:
    for table in (
        "link_transport",
        "link_causal",
        "link_request",
        "link_response",
        "callback_instance",
        "response",
    ):
        con.execute(f"DELETE FROM store.{table}")
    for publication, take in links["transport"]:
        con.execute(
            "INSERT INTO store.link_transport (run_id, publication_id, take_id, method, "
            "is_self_loop, is_loss_affected) VALUES (1, ?, ?, 'exact', false, false)",
            [publication, take],
        )
    for callback, publication in links["causal"]:
        con.execute(
            "INSERT INTO store.link_causal (run_id, callback_instance_id, publication_id, kind, "
            "is_loss_affected) VALUES (1, ?, ?, 'direct', false)",
            [callback, publication],
        )
    for callback, request in links["requested"]:
        con.execute(
            "INSERT INTO store.link_request (run_id, callback_instance_id, request_id) "
            "VALUES (1, ?, ?)",
            [callback, request],
        )
    for callback, response in links["answered"]:
        con.execute(
            "INSERT INTO store.link_response (run_id, callback_instance_id, response_id) "
            "VALUES (1, ?, ?)",
            [callback, response],
        )
    for number, request in enumerate(links["replied"], start=1):
        con.execute(
            "INSERT INTO store.response (response_id, run_id, request_id) VALUES (?, 1, ?)",
            [number, request],
        )
    pairs = zip(links["taken"], links["called"], strict=True)
    for number, (take, request) in enumerate(pairs, start=1):
        con.execute(
            "INSERT INTO store.callback_instance (callback_instance_id, run_id, trace_id, "
            "callback_id, process_id, thread_id, start_ns, take_id, request_id, "
            "is_intra_process, depth) VALUES (?, 1, 1, 1, 1, 1, 0, ?, ?, false, 1)",
            [number, take, request],
        )


def walk(con: duckdb.DuckDBPyConnection, macro: str, name: str, number: int) -> set[object]:
    return set(con.execute(f"SELECT kind, id FROM {macro}(?, ?)", [name, number]).fetchall())


@settings(EXAMPLES, max_examples=examples(2, 4))
@given(links=LINKS)
def test_directions_agree(analysis: Analysis, links: dict[str, list[Any]]) -> None:
    """Forward from a reaches b exactly when backward from b reaches a."""
    con = analysis.connection
    con.begin()
    try:
        store_links(con, links)
        vertices = [(name, number) for name in KINDS for number in range(1, 5)]
        forward = {vertex: walk(con, "flow_forward", *vertex) for vertex in vertices}
        backward = {vertex: walk(con, "flow_backward", *vertex) for vertex in vertices}
        for a in vertices:
            assert {b for b in vertices if a in backward[b]} == forward[a]
            assert walk(con, "flow_both", *a) == forward[a] | backward[a]
            assert forward[a] | backward[a] <= walk(con, "flow_component", *a)
    finally:
        con.rollback()
