"""What a test or a program in Python records, with the real LTTng."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from lttng_program import lttng
from recording.tracetools import build_tracetools

from msgflow import Database
from msgflow.testing import Recording, ms, msgflow_recorded

__all__ = ["msgflow_recorded"]

LOADED = """
import ctypes, sys, time
from msgflow.watch.diagnostics import untraced
with untraced():
    ctypes.CDLL(sys.argv[1], ctypes.RTLD_GLOBAL)
time.sleep(30)
"""


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


@pytest.mark.thorough
@pytest.mark.usefixtures("daemon")
def test_what_publishes_diagnostics_is_not_traced(tmp_path: Path) -> None:
    library = build_tracetools(tmp_path)
    loads = [sys.executable, "-c", LOADED, str(library)]
    traced = subprocess.Popen(
        [*loads[:2], LOADED.replace("untraced()", "open('/dev/null')"), library]
    )
    untraced = subprocess.Popen(loads)
    try:
        end = time.monotonic() + 30
        while (listed := lttng("list", "--userspace").stdout) and time.monotonic() < end:
            if f"PID: {traced.pid} " in listed:
                break
            time.sleep(0.2)
        time.sleep(1)
        listed = lttng("list", "--userspace").stdout
        assert f"PID: {traced.pid} " in listed
        assert f"PID: {untraced.pid} " not in listed
    finally:
        for process in (traced, untraced):
            process.kill()
            process.wait()
