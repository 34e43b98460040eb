"""Recorded systems on two hosts whose clocks are known to be apart."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.thorough import few

from msgflow import open_db


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(["pingpong", "services"], "services"))
def test_clocks_come_together(shared_traces: Path, tmp_path: Path, name: str) -> None:
    meta = json.loads((shared_traces / name / "meta.json").read_text())
    truth = {host["hostname"]: host["offset_ns"] for host in meta["hosts"].values()}
    with open_db(tmp_path / "msgflow.duckdb") as database:
        database.ingest(shared_traces / name, clock_sync="messages")
        rows = database.query("clocks").to_arrow().to_pylist()
        negative = database.sql(
            "SELECT count(*) FROM link_transport WHERE latency_ns < 0"
        ).to_arrow()
    # All processes run on one machine: the clocks are apart by a constant, without drift.
    for row in rows:
        expected = truth[row["reference"]] - truth[row["hosts"]]
        assert abs(row["offset_ns"] - expected) <= row["uncertainty_ns"]
        assert abs(row["drift_ppb"]) <= row["drift_uncertainty_ppb"]
    assert {row["reference"] for row in rows} == {"robot-a"}
    assert negative.columns[0][0].as_py() == 0


@pytest.mark.thorough
def test_a_late_start_and_pauses_do_not_keep_clocks_apart(
    shared_traces: Path, tmp_path: Path
) -> None:
    """Most links of it are by the stamp alone, and the clocks drift apart by 40 ppm."""
    with open_db(tmp_path / "msgflow.duckdb") as database:
        database.ingest(shared_traces / "late_drift", clock_sync="messages")
        rows = database.query("clocks").to_arrow().to_pylist()
        findings = database.sql(
            "SELECT name FROM finding WHERE starts_with(name, 'clock_')"
        ).to_arrow()
        methods = database.sql(
            "SELECT l.method, count(*) FROM remote_latency JOIN link_transport AS l "
            "USING (publication_id, take_id) GROUP BY l.method"
        ).to_arrow()
    assert findings.num_rows == 0
    counts = dict(zip(*(column.to_pylist() for column in methods.columns), strict=True))
    assert counts["exact_stamp"] > 4_000
    late = next(row for row in rows if row["hosts"] == "robot-b")
    assert late["reference"] == "robot-a"
    assert abs(late["drift_ppb"] + 39_998) <= late["drift_uncertainty_ppb"]
    assert late["greatest_uncertainty_ns"] < 1_000_000
