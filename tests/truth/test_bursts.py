"""Messages that are published microseconds apart, told by time."""

from __future__ import annotations

from pathlib import Path

import pytest
from ingested import ingest_one
from scoring import compare_simulated

from msgflow.sim import Recording, simulate

RECORDINGS = {
    "perfect": Recording(),
    "drift": Recording(realtime_offset_ns=300_000, slew_ppm=20),
    "far": Recording(realtime_offset_ns=7_000_000),
}


@pytest.mark.parametrize("recording", RECORDINGS)
@pytest.mark.parametrize("system", ["bursts", "bursts_two_hosts"])
def test_no_message_is_taken_for_the_next(tmp_path: Path, system: str, recording: str) -> None:
    """Publications of one publisher follow each other within 2 to 4 µs, and all are found."""
    simulation = simulate(
        system, tmp_path / "trace", factor=0.1, layout="humble", recording=RECORDINGS[recording]
    )
    path = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    score = {score.kind: score for score in compare_simulated(path, simulation.truth)[0]}
    transport = score["transport"]
    assert transport.labels.startswith("nearest")
    assert transport.wrong == 0
    assert transport.missing == 0
    assert transport.found > 1000
