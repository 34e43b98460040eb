"""Real ROS 2: what its nodes wrote down of their messages, beside what msgflow says of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from scoring import compare_real
from support.ingested import Ingested, open_ingested
from support.thorough import few

from msgflow import open_db
from msgflow.ingest import ingest

# Recordings, and how many direct links of each cannot be found: what is published after the
# shutdown of ROS reaches neither rcl nor the trace.
RECORDINGS = {
    "real_cache": 1,
    "real_container": 1,
    "real_events": 0,
    "real_filters": 0,
    "real_intra": 0,
    "real_jazzy_container": 1,
    "real_jazzy_pipeline": 0,
    "real_jazzy_services": 0,
    "real_lifecycle": 0,
    "real_overload": 1,
    "real_pipeline": 0,
    "real_py_mixed": 0,
    "real_py_timer": 0,
    "real_reference": 0,
    "real_rotate": 0,
    "real_services": 0,
    "real_tiny": 0,
}
# What the nodes wrote down, in the time of the trace: `began_ns` is when a callback began.
TRUTH = """
CREATE TEMP TABLE truth AS
SELECT t.* REPLACE (t.t0 + m.clock_offset_ns AS t0, t.t1 + m.clock_offset_ns AS t1),
    t.cb_t0 + m.clock_offset_ns AS began_ns
FROM read_json('{path}', columns = {{
    k: 'VARCHAR', topic: 'VARCHAR', id: 'BIGINT', t0: 'BIGINT', t1: 'BIGINT', cb_t0: 'BIGINT',
    causes: 'JSON[][]', roots: 'JSON[][]', clock_offset_ns: 'BIGINT'
}}) AS t
CROSS JOIN (
    FROM read_json('{path}', columns = {{k: 'VARCHAR', clock_offset_ns: 'BIGINT'}})
    WHERE k = 'meta'
) AS m
"""
# Each flow beside that of the nodes: as many, of the same roots. Callbacks begin right after their
# callback_start, and publish() right before its first event.
FLOWS = """
WITH expected AS (
    SELECT a.began_ns, (a.root[3])::BIGINT AS latency_ns, b.t0, b.t1
    FROM (SELECT topic, began_ns, unnest(roots) AS root FROM truth WHERE k = 'delivery') AS a
    JOIN truth AS b
        ON b.k = 'publication' AND b.topic = a.root[1]->>'$' AND b.id = (a.root[2])::BIGINT
    WHERE a.topic = '{sink}' AND b.topic = '{source}'
),
found AS (
    FROM end_to_end([1], '{source}', '{sink}', 'publish', 'callback_start')
    WHERE status = 'reached'
)
SELECT
    (SELECT count(*) FROM found), count(*), count(DISTINCT f.sink_ns),
    count_if(f.root_ns BETWEEN e.t0 AND e.t1),
    min(e.latency_ns - f.latency_ns) >= 0, median(e.latency_ns - f.latency_ns) < 10_000
FROM expected AS e
ASOF JOIN found AS f ON e.began_ns >= f.sink_ns
"""
# The messages that a publication was made of, by their own publications.
MADE_OF = """
SELECT o.publication_id, i.publication_id
FROM (
    SELECT topic, t0, t1, unnest(causes) AS cause
    FROM truth
    WHERE k = 'publication' AND topic = '/approx'
) AS made
JOIN sent AS o ON made.topic = o.topic_name AND o.start_ns BETWEEN made.t0 AND made.t1
JOIN truth AS c
    ON c.k = 'publication' AND c.topic = made.cause[1]->>'$' AND c.id = (made.cause[2])::BIGINT
JOIN sent AS i ON c.topic = i.topic_name AND i.start_ns BETWEEN c.t0 AND c.t1
"""
LINKED = """
SELECT l.publication_id, m.publication_id
FROM link_causal AS l
JOIN sent AS o ON l.publication_id = o.publication_id AND o.topic_name = '/approx'
JOIN callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
JOIN link_transport AS m ON i.take_id = m.take_id
WHERE l.candidate_count = 1
"""
SENT = """
CREATE TEMP VIEW sent AS
SELECT b.publication_id, b.start_ns, p.topic_name
FROM publication AS b
JOIN publisher AS p USING (publisher_id)
"""
APPROXIMATE = """
links:
  - kind: approximate_sync
    node: /approx
    inputs: [/a, /b]
    outputs: [/approx]
"""


def load_truth(recording: Ingested, path: Path) -> None:
    """Make what the nodes wrote down the table `truth`."""
    recording.connection.execute(TRUTH.format(path=path))


@pytest.mark.parametrize("name", few(RECORDINGS, "real_container"))
def test_links_are_right(real: Callable[[str], Path], shared_traces: Path, name: str) -> None:
    scores = compare_real(real(name), shared_traces / name / "truth.jsonl.gz")
    assert {one.kind for one in scores if one.found} >= {"transport"}
    assert [one for one in scores if one.wrong] == []
    assert {one.kind: one.missing for one in scores if one.missing} == (
        {"direct": RECORDINGS[name]} if RECORDINGS[name] else {}
    )


@pytest.mark.parametrize(
    ("name", "source", "sink", "flows"),
    few(
        [
            ("real_pipeline", "/scan", "/filtered", 133),
            ("real_container", "/camera", "/objects", 58),
            ("real_container", "/imu", "/odom", 191),
            ("real_overload", "/fast", "/slow_out", 100),
        ],
        ("real_container", "/camera", "/objects", 58),
        ("real_overload", "/fast", "/slow_out", 100),
    ),
)
def test_latencies_are_those_of_the_nodes(
    real: Callable[[str], Path], shared_traces: Path, name: str, source: str, sink: str, flows: int
) -> None:
    """The nodes carry the stamps of all roots in their messages."""
    recording = open_ingested(real(name))
    with recording.connection:
        load_truth(recording, shared_traces / name / "truth.jsonl.gz")
        assert recording.rows(FLOWS.format(source=source, sink=sink)) == [
            (flows, flows, flows, flows, True, True)
        ]


@pytest.mark.thorough
def test_a_set_of_messages_closest_in_time(shared_traces: Path, tmp_path: Path) -> None:
    """The filter of /approx wrote down what it made each set of."""
    trace = shared_traces / "real_filters"
    (tmp_path / "links.yaml").write_text(APPROXIMATE)
    ingest([trace / "ust"], tmp_path / "run.duckdb", links=tmp_path / "links.yaml")
    recording = open_ingested(tmp_path / "run.duckdb")
    with recording.connection:
        load_truth(recording, trace / "truth.jsonl.gz")
        recording.connection.execute(SENT)
        assert len(recording.rows(MADE_OF)) == 190
        assert recording.differences(MADE_OF, LINKED) == ([], [])


@pytest.mark.thorough
def test_a_set_of_messages_closest_in_time_is_suggested(real: Callable[[str], Path]) -> None:
    with open_db(real("real_filters")) as database:
        text = database.suggest_links().text("msgflow links apply FILE")
    declared = APPROXIMATE.removeprefix("\nlinks:\n").splitlines()
    assert "".join(f"  # {line.removeprefix('  ')}\n" for line in declared) in text
