"""Messages that are published microseconds apart, told by time."""

from __future__ import annotations

from pathlib import Path

import pytest
from ingested import ingest_one
from scoring import compare_simulated
from thorough import few, thorough

from msgflow.sim import Recording, simulate

RECORDINGS = {
    "perfect": Recording(),
    "drift": Recording(realtime_offset_ns=300_000, slew_ppm=20),
    "far": Recording(realtime_offset_ns=7_000_000),
}


@pytest.mark.parametrize("recording", few(RECORDINGS, "drift"))
@pytest.mark.parametrize("system", few(["bursts", "bursts_two_hosts"], "bursts_two_hosts"))
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


@pytest.mark.parametrize(
    ("offset_ns", "slew_ppm", "factor", "least"),
    [
        thorough(7_000_000, 150, 0.3, 4_100),
        (300_000, -150, 0.1, 1_200),
        thorough(5_509_365, -170, 0.2, 700),
    ],
)
def test_a_fast_clock_makes_none_wrong(
    tmp_path: Path, offset_ns: int, slew_ppm: int, factor: float, least: int
) -> None:
    """A vote of too many stretches at once would not find the drift; a wrong one is noticed."""
    recording = Recording(realtime_offset_ns=offset_ns, slew_ppm=slew_ppm)
    simulation = simulate(
        "bursts_two_hosts", tmp_path / "trace", factor=factor, layout="humble", recording=recording
    )
    path = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    score = {score.kind: score for score in compare_simulated(path, simulation.truth)[0]}
    assert score["transport"].wrong == 0
    assert score["transport"].found > least
