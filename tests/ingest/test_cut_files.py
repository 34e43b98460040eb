"""A trace whose files end too early: what is missing is not what a full buffer discarded."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from msgflow.db.connection import connect
from msgflow.ingest import ingest


@pytest.mark.thorough
def test_a_cut_packet_is_not_blamed_on_buffers(
    trace: Path, tmp_path: Path, new_database: Path
) -> None:
    copy = shutil.copytree(trace, tmp_path / "robot")
    stream = max(copy.rglob("ros2_*"), key=lambda file: file.stat().st_size)
    # The tracer fills whole pages: content ends where the zeros begin.
    os.truncate(stream, len(stream.read_bytes().rstrip(b"\0")) - 1_000)
    report = ingest([copy], new_database)
    names = {finding.name for finding in report.findings}
    assert "damaged_trace" in names
    assert "discarded_events" not in names
    with connect(new_database, read_only=True) as connection:
        gaps = connection.execute("SELECT kind, event_count FROM gap").fetchall()
        assert ("loss", None) in gaps
