"""What a test or a program in Python records, with the real LTTng."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from msgflow import Database
from msgflow.testing import Recording, ms, msgflow_recorded

__all__ = ["msgflow_recorded"]


@pytest.mark.thorough
def test_a_block_of_a_test_is_recorded(robot: list[str], msgflow_recorded: Recording) -> None:
    before = dict(os.environ)
    with msgflow_recorded() as database:
        subprocess.run(["timeout", "-s", "INT", "6", *robot, "0.05"])
    assert dict(os.environ) == before
    latency = database.e2e("/image", "/detector")
    assert latency.reached > 10
    assert 0 < latency.p50 < ms(1_000)
    # Its nodes are of Python, which is traced without a word.
    assert database.query("callbacks", node="/detector").to_arrow().num_rows


@pytest.mark.thorough
def test_python_records_a_program(robot: list[str], tmp_path: Path) -> None:
    said: list[str] = []
    with Database(tmp_path / "msgflow.duckdb") as database:
        report = database.record(
            [*robot, "0.05"], directory=tmp_path / "drive", seconds=6, note=said.append
        )
        assert report.run_name == "drive"
        assert database.query("e2e-latency", to="/detector").to_arrow()["reached"][0].as_py() > 10
