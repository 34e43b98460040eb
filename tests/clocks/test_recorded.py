"""Recorded systems on two hosts whose clocks are known to be apart."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from msgflow import open_db


@pytest.mark.parametrize("name", ["pingpong", "services"])
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
