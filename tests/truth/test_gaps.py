"""What is said near gaps is true: losses of one CPU, holes between packets, snapshots."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest
from scoring import compare_simulated
from support.ingested import ingest_one
from support.thorough import few

from msgflow_sim import Recording, simulate

SECOND = 1_000_000_000
SMALL = {"packet_bytes": 4096, "lost_event_share": 0.8, "longest_loss": 400}
# Recording, the gaps that it has to show, and whether all that happened must be found.
RECORDINGS: dict[str, tuple[Recording, set[str], bool]] = {
    "brim": (Recording(**SMALL, filled_share=0.3), {"loss"}, False),
    "one_cpu": (Recording(**SMALL, lossy_cpus=(1,), start_ns=SECOND // 5), {"loss"}, False),
    "rotated": (Recording(rotations=(SECOND // 3, SECOND // 2)), set(), True),
    "stopped": (
        Recording(pauses=((SECOND // 3, SECOND // 2),), rotations=(SECOND // 4, SECOND * 2 // 5)),
        {"pause"},
        False,
    ),
    "last_snapshot": (
        Recording(
            snapshots=(SECOND // 3, SECOND * 3 // 5),
            kept_packets=12,
            is_last_snapshot_only=True,
            packet_bytes=4096,
        ),
        {"packets"},
        False,
    ),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(RECORDINGS, "brim"))
def test_what_is_said_near_gaps_is_true(tmp_path: Path, name: str) -> None:
    recording, gaps, is_complete = RECORDINGS[name]
    simulation = simulate(
        "container_multi_threaded", tmp_path / "trace", factor=0.1, recording=recording
    )
    database = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, database).connection.close()
    scores, _ = compare_simulated(database, simulation.truth)
    found = {score.kind: score for score in scores}
    assert {kind for kind, score in found.items() if score.wrong} == set()
    for kind in ("kind", "called_with", "transport", "direct", "executor_state"):
        assert found[kind].found > 0
    if is_complete:
        assert {kind for kind, score in found.items() if score.missing} == set()
    with duckdb.connect(str(database), read_only=True) as connection:
        rows = connection.execute("SELECT DISTINCT kind FROM gap").fetchall()
    assert {kind for (kind,) in rows} == gaps


MS = 1_000_000
PAUSE = (2_120 * MS, 2_270 * MS)
# Recordings of a system that is silent for 300 ms again and again, and where they were stopped.
QUIET: dict[str, tuple[Recording, list[int]]] = {
    "stopped": (Recording(pauses=(PAUSE,)), [2_120]),
    "ended_by_a_timer": (Recording(flush_ns=SECOND), []),
    "stopped_between_ticks": (Recording(pauses=(PAUSE,), flush_ns=SECOND), [2_120]),
    "rotated": (Recording(rotations=(2_120 * MS, 3_160 * MS)), []),
    "stopped_in_a_chunk": (Recording(rotations=(SECOND,), pauses=(PAUSE,)), [2_120]),
    "last_snapshot": (
        Recording(
            snapshots=(2_120 * MS, 3_160 * MS, 4_000 * MS),
            kept_packets=1_000,
            is_last_snapshot_only=True,
        ),
        [],
    ),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(QUIET, "stopped_between_ticks"))
def test_a_quiet_system_pauses_where_it_was_stopped(tmp_path: Path, name: str) -> None:
    """Though nothing is lost, and it is as silent everywhere else."""
    recording, pauses = QUIET[name]
    simulation = simulate("quiet", tmp_path / "trace", factor=0.5, recording=recording)
    database = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, database).connection.close()
    with duckdb.connect(str(database), read_only=True) as connection:
        rows = connection.execute(
            "SELECT kind, round((l.start_ns - r.start_ns) / 1e6)::BIGINT "
            "FROM gap AS l CROSS JOIN run AS r WHERE kind = 'pause'"
        ).fetchall()
    assert rows == [("pause", at) for at in pauses]
    scores, drops = compare_simulated(database, simulation.truth)
    assert [score for score in scores if score.wrong] == []
    assert drops is not None
    assert [drop for drop in drops if not drop.is_right and not drop.undecided] == []


@pytest.mark.thorough
def test_a_rotation_is_no_pause_however_silent_the_system_is(tmp_path: Path) -> None:
    """The one long callback runs across the border: it keeps its end, and what it causes."""
    recording = Recording(rotations=(4 * SECOND // 3,))
    simulation = simulate("stall", tmp_path / "trace", recording=recording)
    database = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, database).connection.close()
    with duckdb.connect(str(database), read_only=True) as connection:
        assert connection.execute("FROM gap").fetchall() == []
        assert connection.execute(
            "SELECT count(*), bool_or(n.start_ns - r.start_ns < 1_333_333_333 "
            "AND n.end_ns - r.start_ns > 1_433_333_333) "
            "FROM callback_instance AS n CROSS JOIN run AS r "
            "WHERE n.end_ns - n.start_ns > 100_000_000"
        ).fetchall() == [(1, True)]
    scores, _ = compare_simulated(database, simulation.truth)
    assert [score for score in scores if score.wrong or score.missing] == []
