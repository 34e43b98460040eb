"""A trace without events beside others is told; a copy, of which nothing is read, is not one."""

from __future__ import annotations

import shutil
from pathlib import Path

from msgflow.db.connection import connect
from msgflow.db.finding import find
from msgflow.ingest import ingest


def empty_traces(database: Path) -> list[str]:
    with connect(database, read_only=True) as connection:
        return [f.subject for f in find(connection, [1]) if f.name == "empty_trace"]


def test_metadata_alone(trace: Path, tmp_path: Path, new_database: Path) -> None:
    alone = tmp_path / "alone"
    alone.mkdir()
    shutil.copy(next(trace.rglob("metadata")), alone)
    report = ingest([trace, alone], new_database)
    assert [d.severity for d in report.diagnostics if d.name == "empty_trace"] == ["warning"]
    assert empty_traces(new_database) == [str(alone)]


def test_a_copy(trace: Path, tmp_path: Path, new_database: Path) -> None:
    ingest([trace, shutil.copytree(trace, tmp_path / "copy")], new_database)
    assert empty_traces(new_database) == []
