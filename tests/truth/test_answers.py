"""Code without callback events: answers to messages are told from what timers publish."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from scoring import compare_simulated
from support.ingested import Ingested, ingest_one
from support.thorough import few

from msgflow_sim import Buffers, Recording, simulate

PLACE = """
CREATE TEMP VIEW IF NOT EXISTS place AS
SELECT t.thread_id, h.hostname, p.pid, t.tid
FROM thread AS t
JOIN process AS p ON t.process_id = p.process_id
JOIN host AS h ON p.host_id = h.host_id
"""
TRUE = """
SELECT host, pid, tid, take_rmw_ns, topic_name, publication_rmw_ns
FROM truth_causal
WHERE kind = 'take_adjacent'
"""
FOUND = """
SELECT p.hostname, p.pid, p.tid, t.taken_ns, u.topic_name, b.rmw_ns
FROM link_causal AS l
JOIN take AS t ON l.take_id = t.take_id
JOIN place AS p USING (thread_id)
JOIN publication AS b USING (publication_id)
JOIN publisher AS u USING (publisher_id)
WHERE l.kind = 'take_adjacent' AND l.candidate_count
"""
PAIRS = """
SELECT s.topic_name, u.topic_name, l.candidate_count, count(*)
FROM link_causal AS l
JOIN take AS t ON l.take_id = t.take_id
JOIN subscription AS s ON t.subscription_id = s.subscription_id
LEFT JOIN publication AS b USING (publication_id)
LEFT JOIN publisher AS u USING (publisher_id)
WHERE l.kind = 'take_adjacent'
GROUP BY ALL
ORDER BY ALL
"""
PATHS = """
SELECT array_to_string(h.topics, ' '), count(*)
FROM end_to_end([1], NULL, NULL, 'callback_start', 'take', 0, 9223372036854775807) AS e
JOIN flow_path([1], NULL, NULL) AS h USING (path_id)
WHERE e.status = 'reached'
GROUP BY ALL
ORDER BY ALL
"""
# Publications by topics of input and output, and the number of candidates; messages by path.
RECORDED = {
    "real_py_timer": (
        [("/scan", "/filtered", 1, 117), ("/scan", "/tick", 2, 288)],
        {"/scan /filtered", "/tick"},
    ),
    "real_py_mixed": ([("/scan", "/filtered", 1, 112)], {"/scan /filtered"}),
    "rclpy_timer": (
        [
            ("/topic_a", "/pm_periodic", 2, 258),
            ("/topic_a", "/pm_relay", 1, 373),
            ("/topic_a", "/po_relay", 1, 372),
            ("/topic_a", "/py_periodic", 2, 259),
            ("/topic_a", "/py_relay", 1, 373),
        ],
        {
            "/pm_periodic",
            "/py_periodic",
            "/topic_a /pm_relay",
            "/topic_a /po_relay",
            "/topic_a /py_relay",
        },
    ),
}

# Real and emulated: three nodes in one busy executor, loops by a clock of their own, and timers in
# step with the messages. What they answer; all else comes from timers and loops.
ANSWERED = {
    "1-rclpy-three-nodes": [("/o01q", "/o02", 267), ("/t1", "/o00", 2815), ("/t1", "/o01", 2762)],
    "4-main-loops": [("/a_relay", "/ws_a", 290), ("/slow", "/loop4_relay", 10)],
    "11-rclpy-step-timer": [
        ("/a", "/py1_relay", 343),
        ("/a", "/py2_relay", 343),
        ("/a", "/py3_relay", 366),
        ("/a", "/py4_relay", 341),
    ],
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(ANSWERED, "4-main-loops"))
def test_only_answers_are_certain(recordings: Callable[[str], Ingested], name: str) -> None:
    pairs = recordings(f"../wild/{name}.tar.xz").rows(PAIRS)
    assert [
        (*topics, count) for *topics, candidates, count in pairs if candidates == 1
    ] == ANSWERED[name]


@pytest.mark.parametrize("name", few(RECORDED, "real_py_mixed"))
def test_recorded_timers_are_doubtful_and_no_path_follows_them(
    recordings: Callable[[str], Ingested], name: str
) -> None:
    ingested = recordings(name)
    pairs, paths = RECORDED[name]
    assert ingested.rows(PAIRS) == pairs
    reached = dict(ingested.rows(PATHS))
    assert set(reached) == paths
    assert min(reached.values()) > 100
    subjects = ingested.rows(
        "SELECT detail FROM finding WHERE name = 'doubtful_answer' ORDER BY detail"
    )
    assert [detail for (detail,) in subjects] == sorted(
        f"{output} after {source} ({count} publications)"
        for source, output, candidates, count in pairs
        if candidates == 2
    )


@pytest.mark.parametrize("name", few(["python", "python_timers"], "python"))
def test_simulated_answers_are_certain_and_all_else_is_marked(
    simulations: Callable[[str], Ingested], name: str
) -> None:
    simulated = simulations(name)
    simulated.connection.execute(PLACE)
    assert simulated.differences(TRUE, f"{FOUND} = 1") == ([], [])
    assert simulated.rows(f"{TRUE} INTERSECT ({FOUND} = 2)") == []
    marked = len(simulated.rows(f"{FOUND} = 2"))
    assert (marked > 50) == (name == "python_timers")


@pytest.mark.thorough
def test_a_timer_shows_between_gaps(tmp_path: Path) -> None:
    """It is older than the recording, which stops, loses events and ends early on one CPU."""
    third = 333_333_333
    recording = Recording(
        start_ns=50_000_000,
        pauses=((third, 500_000_000),),
        rotations=(2 * third,),
        buffers=Buffers.PER_PROCESS,
        lost_event_share=0.2,
        lost_packet_share=0.05,
        unfinished_streams=1,
        slew_ppm=-20,
    )
    simulation = simulate(
        "python_timers",
        tmp_path / "trace",
        layout="jazzy",
        factor=0.1,
        recording=recording,
        clock_offset_ns=350_000_000,
    )
    database = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, database).connection.close()
    scores, _ = compare_simulated(database, simulation.truth)
    (score,) = (each for each in scores if each.kind == "take_adjacent")
    assert (score.wrong, score.missing) == (0, 0)
    assert score.decided > 100
    assert score.misguessed > 50
