"""Long paths and bursts: the memory of an answer grows with its rows, not with their square."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest
from support.analysis import Analysis
from support.golden import SYSTEMS, fill
from support.ros_system import RosSystem
from support.staged_events import Thread

from msgflow.db.derivation import derive
from msgflow.db.sandbox import open_memory
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query

TALKER, HEARER = Thread(100), Thread(200)
LENGTH, MESSAGES = 1500, 4000


def limit(con: duckdb.DuckDBPyConnection, most: str) -> None:
    """Take no more memory than that, and no disk in its place."""
    con.execute("SET memory_limit = ?", [most])
    con.execute("SET temp_directory = ''")
    con.execute("SET threads = 2")


@pytest.mark.thorough
def test_a_long_path(fresh_database: Path) -> None:
    con = open_memory()
    con.execute(f"ATTACH '{fresh_database}' AS target; USE target")
    fill(con)
    con.execute((SYSTEMS / "long_line.sql").read_text())
    derive(con, 1)
    limit(con, "450MB")
    given = {"max_depth": LENGTH}
    (path,) = run_query(con, load_query("e2e-latency"), given).to_arrow().to_pylist()
    full = given | {"detail": "full"}
    parts = run_query(con, load_query("critical-path"), full).to_arrow().to_pylist()
    con.close()
    assert (path["roots"], path["reached"], path["is_cut"]) == (2, 2, False)
    # From the start of the first callback to the end of the last.
    assert path["min_ns"] == path["max_ns"] == 100 * LENGTH + 50
    steps = (f"/node_{n} → /topic_{n}" for n in range(1, LENGTH + 1))
    assert path["path"] == " → ".join([*steps, f"/node_{LENGTH + 1}"])
    assert sum(part["duration_ns"] for part in parts) == 100 * LENGTH + 50
    assert [part["hop"] for part in parts if part["part"] == "publish_to_take"] == list(
        range(1, LENGTH + 1)
    )


@pytest.mark.thorough
def test_a_burst(empty_database: Path, tmp_path: Path) -> None:
    """One callback publishes thousands of messages: each waits for all before it."""
    system = RosSystem()
    system.node(TALKER, 0x1, "talker")
    system.publisher(TALKER, 0x10, "/a")
    system.timer(TALKER, 0x20, 0xC0)
    system.node(HEARER, 0x1, "hearer")
    system.subscription(HEARER, 0x30, "/a", callback=0xC1)
    system.ready(HEARER)
    system.start(TALKER, 0xC0)
    for stamp in range(1, MESSAGES + 1):
        system.publish(TALKER, 0x10, stamp)
    system.end(TALKER, 0xC0)
    for stamp in range(1, MESSAGES + 1):
        system.take(HEARER, 0x30, stamp)
        system.start(HEARER, 0xC1)
        system.end(HEARER, 0xC1)
    system.ready(HEARER)
    analysis = Analysis(empty_database, tmp_path)
    con = analysis.build(system).connection
    limit(con, "450MB")
    full = {"detail": "full", "case": "every_pair"}
    parts = run_query(con, load_query("critical-path"), full).to_arrow().to_pylist()
    (pair,) = run_query(con, load_query("waits-pair"), {}).to_arrow().to_pylist()
    waits = run_query(con, load_query("waits-instance"), {}).to_arrow().to_pylist()
    by_callback = run_query(con, load_query("waits"), {}).to_arrow().to_pylist()
    analysis.close()
    assert (pair["waits"], pair["instances"]) == (MESSAGES - 1, MESSAGES * (MESSAGES - 1) // 2)
    assert pair["overlap_max_ns"] == sum(wait["busy_max_ns"] or 0 for wait in waits)
    (hearer,) = (row for row in by_callback if row["node"] == "/hearer")
    assert hearer["meanwhile"] == "Subscription(/a) 100 %"
    assert hearer["busy_total_max_ns"] == pair["overlap_max_ns"]
    assert sum(part["duration_ns"] for part in parts) == parts[0]["latency_ns"]
    busy = [part["callback_instance_id"] for part in parts if part["activity"] == "executor_busy"]
    # The last message waited for the callbacks of all others.
    assert len(set(busy)) == len(busy) == MESSAGES - 1
