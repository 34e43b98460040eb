"""Recorded systems whose truth is known, scored by the checker that comes with the recordings."""

from __future__ import annotations

import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from scoring import compare_recorded
from support.ingested import Ingested
from support.thorough import few

Vertex = tuple[str, int]

# Systems with a truth, and a kind of link that each is there for.
TRUE_TRACES = {
    "sync_1_1": "direct",
    "sync_1_1_humble": "direct",
    "sync_1_1_jazzy": "direct",
    "pingpong": "direct",
    "services": "service",
    "periodic_async_jazzy24": "periodic_async",
    "partial_sync": "partial_sync",
    "containers_one_daemon": "direct",
    "containers_same_name": "direct",
}
EXPORTS = {
    "pairs": """
        SELECT bp.hostname AS pub_host, bp.pid AS pub_vpid, b.start_ns AS pub_ts,
            tp.hostname AS take_host, tp.pid AS take_vpid, t.taken_ns AS take_ts
        FROM link_transport AS l
        JOIN publication AS b USING (publication_id)
        JOIN place AS bp ON b.process_id = bp.process_id
        JOIN take AS t ON l.take_id = t.take_id
        JOIN place AS tp ON t.process_id = tp.process_id
    """,
    "links": """
        SELECT p.hostname AS in_host, p.pid AS in_vpid, t.taken_ns AS in_ts,
            p.hostname AS out_host, p.pid AS out_vpid, b.start_ns AS out_ts, l.kind AS type
        FROM link_causal AS l
        JOIN callback_instance AS i USING (callback_instance_id)
        JOIN take AS t ON i.take_id = t.take_id
        JOIN publication AS b USING (publication_id)
        JOIN place AS p ON b.process_id = p.process_id
    """,
    "exec": """
        SELECT p.hostname AS host, p.pid AS vpid, t.tid AS vtid, e.start_ns AS "start",
            coalesce(e.end_ns, (SELECT max(end_ns) FROM trace)) AS "end",
            replace(e.state, 'process', 'overhead') AS state
        FROM executor_state AS e
        JOIN thread AS t USING (thread_id)
        JOIN place AS p ON t.process_id = p.process_id
    """,
    "e2e": """
        SELECT rp.hostname AS root_host, rp.pid AS root_vpid, b.start_ns AS root_ts,
            tp.hostname AS leaf_host, tp.pid AS leaf_vpid, t.taken_ns AS leaf_ts, e.latency_ns
        FROM end_to_end(
            [1], NULL, NULL, 'callback_start', 'callback_end', 0, 9223372036854775807
        ) AS e
        JOIN link_causal AS l ON e.root_id = l.callback_instance_id
        JOIN publication AS b USING (publication_id)
        JOIN publisher AS u ON b.publisher_id = u.publisher_id AND NOT u.is_internal
        JOIN place AS rp ON b.process_id = rp.process_id
        JOIN take AS t ON e.take_id = t.take_id
        JOIN place AS tp ON t.process_id = tp.process_id
        WHERE e.root_kind = 'callback_instance'
    """,
}
SERVICE_EXPORTS = {
    "pairs": """
        SELECT sp.hostname AS pub_host, sp.pid AS pub_vpid, m.sent_ns AS pub_ts,
            tp.hostname AS take_host, tp.pid AS take_vpid, m.taken_ns AS take_ts
        FROM (
            SELECT sender_thread_id, receiver_thread_id, sent_ns, taken_ns FROM request
            UNION ALL
            SELECT sender_thread_id, receiver_thread_id, sent_ns, taken_ns FROM response
        ) AS m
        JOIN thread AS s ON m.sender_thread_id = s.thread_id
        JOIN place AS sp ON s.process_id = sp.process_id
        JOIN thread AS t ON m.receiver_thread_id = t.thread_id
        JOIN place AS tp ON t.process_id = tp.process_id
    """,
    "links": """
        SELECT p.hostname AS in_host, p.pid AS in_vpid, i.start_ns AS in_ts,
            p.hostname AS out_host, p.pid AS out_vpid, e.to_ns AS out_ts, e.link_kind AS type
        FROM flow_edge AS e
        JOIN callback_instance AS i ON e.from_id = i.callback_instance_id
        JOIN place AS p USING (process_id)
        WHERE e.from_kind = 'callback_instance' AND coalesce(i.take_id, i.request_id) IS NOT NULL
    """,
}
# Each host has a folder, also if it is a container that has its hostname from another one.
PLACE = """
CREATE TEMP VIEW IF NOT EXISTS place AS
WITH seen AS (
    SELECT process_id, trace_id FROM publication
    UNION
    SELECT process_id, trace_id FROM take
)
SELECT
    p.process_id, regexp_extract(any_value(t.path), '/trace-([^/]+)/', 1) AS hostname, p.pid
FROM process AS p
JOIN seen AS s ON p.process_id = s.process_id
JOIN trace AS t ON s.trace_id = t.trace_id
GROUP BY p.process_id, p.pid
"""


@pytest.fixture(scope="session")
def checker(shared_traces: Path) -> Path:
    path = shared_traces.parent / "tools" / "check_truth.py"
    if not path.is_file():
        pytest.skip("the checker of the recorded traces (../shared/tools) is not here")
    return path


@pytest.mark.parametrize(
    "name",
    few(TRUE_TRACES, "sync_1_1"),
)
def test_scores(
    recordings: Callable[[str], Ingested],
    shared_traces: Path,
    checker: Path,
    tmp_path: Path,
    name: str,
) -> None:
    scores = score(recordings(name), EXPORTS, shared_traces / name, checker, tmp_path, "--builtin")
    agreement = scores.pop("exec")
    assert scores == dict.fromkeys(("pairs", "links", "e2e"), ("1.0000", "1.0000"))
    assert float(agreement[0]) >= 0.99


# Systems on which links were wrong or missing once, kinds of links that were, and which share of
# those that the trace decides there must be now.
ONCE_WRONG = {
    # A rotation in a silence.
    "rotated_autoware": {"direct": 1.0, "partial_sync": 1.0, "periodic_async": 1.0},
    # A step of the clock between bursts: in the two stretches around it, nothing is linked.
    "clock_step": {"transport": 0.98},
    # Messages that nobody took have others in their place.
    "untraced_rival": {"transport": 1.0},
    # Writes that go on at the same time: some messages may be of either.
    "large_messages": {"transport": 1.0},
    # One message was stamped so late that later ones of other threads had been taken before.
    "shared_publisher": {"transport": 0.9998},
}
# How many messages there are, and how many of them had one write that they may be of.
DECIDED = {
    "clock_step": (12_727, 12_727),
    "untraced_rival": (3_672, 1_484),
    "large_messages": (2_056, 1_877),
    "shared_publisher": (7_108, 6_508),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(ONCE_WRONG, "untraced_rival"))
def test_what_was_wrong_is_right(
    recordings: Callable[[str], Ingested], shared_traces: Path, name: str
) -> None:
    ingested = recordings(name)
    path = Path(ingested.rows("SELECT path FROM duckdb_databases() WHERE NOT internal")[0][0])
    scores = {
        score.kind: score
        for score in compare_recorded(path, shared_traces / name / "truth.jsonl.gz")
    }
    for kind, least in ONCE_WRONG[name].items():
        assert scores[kind].wrong == 0, kind
        assert scores[kind].recall >= least, kind
    if name in DECIDED:
        assert (scores["transport"].happened, scores["transport"].decided) == DECIDED[name]
    steps = ingested.rows("SELECT count, detail FROM finding WHERE name = 'clock_set'")
    assert steps == (
        [(128, "+0.007 ms between 3.433 s and 3.523 s after recording began")]
        if name == "clock_step"
        else []
    )
    reasons = ingested.rows("SELECT count(*) FROM store.orphan_take WHERE reason = 'clock_set'")
    assert reasons == [(128 if name == "clock_step" else 0,)]


@pytest.mark.thorough
def test_answers_of_rclpy_are_right_and_its_timers_are_marked(
    recordings: Callable[[str], Ingested], shared_traces: Path
) -> None:
    """No callback of rclpy has events, so none is missing; 517 publications are of timers."""
    ingested = recordings("rclpy_timer")
    path = Path(ingested.rows("SELECT path FROM duckdb_databases() WHERE NOT internal")[0][0])
    scores = compare_recorded(path, shared_traces / "rclpy_timer" / "truth.jsonl.gz")
    assert {(score.precision, score.recall, score.doubted) for score in scores} == {(1, 1, 0)}
    assert {score.kind: (score.decided, score.misguessed) for score in scores} == {
        "direct": (373, 0),
        "take_adjacent": (1118, 517),
        "transport": (2811, 0),
    }


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["lossy_intra_mt", "intra_lost", "snapshots_intra"])
def test_nothing_is_wrong_where_events_were_lost(
    recordings: Callable[[str], Ingested],
    shared_traces: Path,
    checker: Path,
    tmp_path: Path,
    name: str,
) -> None:
    """Copies of messages in ring buffers that are never read are no arrivals, either."""
    scores = score(recordings(name), EXPORTS, shared_traces / name, checker, tmp_path, "--builtin")
    del scores["exec"]
    assert {table: precision for table, (precision, _) in scores.items()} == dict.fromkeys(
        ("pairs", "links", "e2e"), "1.0000"
    )
    assert all(float(recall) > 0.94 for _, recall in scores.values())


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "kind", "count"),
    few(
        [("client_callbacks", "link_call", 1448), ("polling", "polled", 866)],
        ("polling", "polled", 866),
    ),
)
def test_what_follows_from_responses_and_polled_messages(
    recordings: Callable[[str], Ingested], shared_traces: Path, name: str, kind: str, count: int
) -> None:
    """Of the polled messages those that were taken in the callback itself are decided."""
    ingested = recordings(name)
    path = Path(ingested.rows("SELECT path FROM duckdb_databases() WHERE NOT internal")[0][0])
    scores = compare_recorded(path, shared_traces / name / "truth.jsonl.gz")
    assert {(score.precision, score.recall, score.doubted) for score in scores} == {(1, 1, 0)}
    assert {score.kind: score.found for score in scores}[kind] == count


@pytest.mark.thorough
def test_flows_go_on_from_responses_of_real_services(
    recordings: Callable[[str], Ingested], shared_traces: Path
) -> None:
    """The client's callback publishes, and a deferred response follows from another one."""
    if not (shared_traces / "real_services").is_dir():
        pytest.skip("the recording of real services is not here")
    ingested = recordings("real_services")
    assert ingested.rows(
        "SELECT count(taken_response_id), count(publication_id), count(response_id), "
        "max(candidate_count) FROM link_call"
    ) == [(110, 55, 55, 1)]
    assert ("/caller → (/outer) → /outer → /caller → /result → /observer",) in ingested.rows(
        "SELECT path FROM flow_path([1]) WHERE is_path"
    )


@pytest.mark.thorough
def test_wrong_inputs_of_a_reentrant_node_are_marked(
    recordings: Callable[[str], Ingested], shared_traces: Path
) -> None:
    ingested = recordings("mt_partial")
    path = Path(ingested.rows("SELECT path FROM duckdb_databases() WHERE NOT internal")[0][0])
    (score,) = (
        score
        for score in compare_recorded(path, shared_traces / "mt_partial" / "truth.jsonl.gz")
        if score.kind == "partial_sync"
    )
    assert (score.wrong, score.missing, score.repeated) == (0, 0, 0)
    assert score.misguessed > 100
    assert score.found == score.happened == 994
    assert ingested.rows("SELECT count(*) FROM annotation_firing WHERE NOT is_complete") < [(5,)]


def test_scores_of_services(
    recordings: Callable[[str], Ingested], shared_traces: Path, checker: Path, tmp_path: Path
) -> None:
    """Requests and responses, and what links them with each other and with messages."""
    ingested = recordings("services")
    trace = shared_traces / "services"
    scores = score(ingested, SERVICE_EXPORTS, trace, checker, tmp_path, "--services")
    assert scores == dict.fromkeys(("pairs", "links"), ("1.0000", "1.0000"))
    counts = ingested.connection.execute(
        "SELECT (SELECT count(*) FROM request), (SELECT count(*) FROM response)"
    ).fetchall()
    assert counts == [(386, 385)]


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "kind"), few(TRUE_TRACES.items(), ("services", "service")))
def test_directions_agree(recordings: Callable[[str], Ingested], name: str, kind: str) -> None:
    """Forward from a reaches b exactly when backward from b reaches a.

    Both follow the public edges, of all vertices, only the other way round; from both ends of
    some links of every kind they reach what a walk along these edges does.
    """
    con = recordings(name).connection
    edge = "SELECT from_kind, from_id, to_kind, to_id, link_kind FROM flow_edge"
    for view, columns in (
        ("flow_link", "from_kind, from_id, to_kind, to_id"),
        ("flow_link_reversed", "to_kind, to_id, from_kind, from_id"),
    ):
        link = f"SELECT {columns}, link_kind FROM derive.{view}"
        assert con.execute(f"({edge} EXCEPT ALL {link})").fetchall() == []
        assert con.execute(f"({link} EXCEPT ALL {edge})").fetchall() == []

    effects, causes, links = defaultdict(set), defaultdict(set), defaultdict(list)
    for *ends, link_kind in con.execute(f"{edge} ORDER BY ALL").fetchall():
        cause, effect = tuple(ends[:2]), tuple(ends[2:])
        effects[cause].add(effect)
        causes[effect].add(cause)
        links[link_kind].append((cause, effect))
    assert kind in links
    for found in links.values():
        for cause, effect in found[:: max(1, len(found) // 3)]:
            for walk, start, neighbours in (
                ("forward", cause, effects),
                ("backward", effect, causes),
            ):
                reached = con.execute(f"FROM flow_{walk}(?, ?)", start).fetchall()
                assert set(reached) == walked(neighbours, start)
                assert len(reached) == len(set(reached)) > 1


def walked(neighbours: Mapping[Vertex, set[Vertex]], start: Vertex) -> set[Vertex]:
    reached, waiting = {start}, [start]
    while waiting:
        found = neighbours.get(waiting.pop(), set()) - reached
        reached |= found
        waiting += found
    return reached


def score(
    ingested: Ingested,
    exports: dict[str, str],
    trace: Path,
    checker: Path,
    directory: Path,
    option: str,
) -> dict[str, tuple[str, ...]]:
    """Return precision and recall of each table, and the agreement of executor states."""
    ingested.connection.execute(PLACE)
    arguments = []
    for table, query in exports.items():
        path = directory / f"{table}.csv"
        ingested.connection.execute(f"COPY ({query}) TO '{path}' (HEADER)")
        arguments += [f"--{table}", str(path)]
    done = subprocess.run(
        [sys.executable, str(checker), str(trace), option, *arguments],
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, tuple[str, ...]] = {
        name: (precision, recall)
        for name, precision, recall in re.findall(
            r"^(\w+) .* precision (\S+)  recall (\S+)", done.stdout, re.MULTILINE
        )
    }
    for agreement in re.findall(r"^exec +agreement (\S+)", done.stdout, re.MULTILINE):
        found["exec"] = (agreement,)
    return found
