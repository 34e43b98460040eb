"""Recordings whose stamps are known, matched by time as if they were not."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path

import duckdb
import pytest
from support.ingested import Ingested
from support.thorough import few

from msgflow.db.connection import connect
from msgflow.db.derivation import derive
from msgflow.ingest import ingest

# A link by what both traces say of it: the threads' events are the same, whatever is ignored.
LINKS = """
SELECT l.publication_id, l.take_id, b.rmw_ns, t.taken_ns, p.pid AS publisher_pid,
    q.pid AS subscriber_pid, t.source_timestamp_ns
FROM store.link_transport AS l
JOIN store.publication AS b ON l.publication_id = b.publication_id
JOIN store.take AS t ON l.take_id = t.take_id
JOIN store.process AS p ON b.process_id = p.process_id
JOIN store.process AS q ON t.process_id = q.process_id
"""
CHANGES = {
    "as_recorded": "SELECT 1",
    "publications_missing": (
        "DELETE FROM store.publication WHERE publication_id * 7919 % 100 < 30"
    ),
    "clock_drifts": (
        "UPDATE store.take SET source_timestamp_ns = source_timestamp_ns + "
        "(source_timestamp_ns - (SELECT min(start_ns) FROM store.publication)) // 50000 "
        "WHERE source_timestamp_ns <> 0"
    ),
    "clock_is_ahead": (
        "UPDATE store.take SET source_timestamp_ns = source_timestamp_ns + 3000000 "
        "WHERE source_timestamp_ns <> 0"
    ),
    "publisher_not_traced": (
        "UPDATE store.publisher SET topic_name = '/x' WHERE NOT is_internal;"
        "UPDATE store.subscription SET topic_name = '/x' WHERE NOT is_internal;"
        "DELETE FROM store.publication WHERE publisher_id = "
        "(SELECT min(publisher_id) FROM store.publisher WHERE topic_name = '/x')"
    ),
}
LEAST_RECALL = {
    # If several processes publish on one topic at the same moment, some messages have no publisher.
    "publisher_not_traced": 0.99,
    # A publication that is missing though nothing was lost is one of a publisher that was not
    # traced. Then what is stamped later than is usual may be of that one.
    "publications_missing": 0.995,
    # Declared parameters are published 10 µs apart. With this drift, the messages of four may be of
    # the write right before.
    "clock_drifts": 0.998,
}


@pytest.fixture(scope="module")
def unstamped(
    shared_traces: Path, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], Path]:
    """Ingests a recording without its stamps of publications."""
    directory = tmp_path_factory.mktemp("unstamped")

    @cache
    def get(name: str) -> Path:
        path = directory / f"{name}.duckdb"
        ingest([shared_traces / name], path, ignore=["dds:*"])
        return path

    return get


@pytest.mark.thorough
@pytest.mark.parametrize("change", few(CHANGES, "publications_missing"))
@pytest.mark.parametrize(
    "name", few(["tracecompass-ros2", "sync_1_1", "partial_sync", "pingpong"], "sync_1_1")
)
def test_nearest_is_exact(
    recordings: Callable[[str], Ingested],
    unstamped: Callable[[str], Path],
    tmp_path: Path,
    name: str,
    change: str,
) -> None:
    path = tmp_path / "changed.duckdb"
    shutil.copyfile(unstamped(name), path)
    truth = {row[2:6] for row in recordings(name).rows(f"{LINKS} WHERE l.method = 'exact'")}
    con = connect(path, read_only=False)
    con.execute(CHANGES[change])
    derive(con, 1)
    rows = con.execute(f"{LINKS} WHERE l.method = 'nearest'").fetchall()
    left = {time for (time,) in con.execute("SELECT rmw_ns FROM store.publication").fetchall()}
    found = [row[2:6] for row in rows]
    expected = {key for key in truth if key[0] in left}
    assert not set(found) - expected
    assert len(found) == len(set(found)) >= LEAST_RECALL.get(change, 1.0) * len(expected) > 0


@pytest.mark.thorough
def test_nothing_is_invented_for_orphans(unstamped: Callable[[str], Path]) -> None:
    """The publisher's trace ends early: forty messages have no publication."""
    with duckdb.connect(str(unstamped("tracecompass-ros2")), read_only=True) as con:
        assert con.execute(
            "SELECT method, count(*) FROM store.link_transport GROUP BY method"
        ).fetchall() == [("nearest", 3994)]
        assert con.execute("SELECT count(*) FROM store.take").fetchall() == [(4034,)]
