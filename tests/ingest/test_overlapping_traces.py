"""The same events recorded by two sessions at once, both given to one ingest."""

from __future__ import annotations

import shutil
from pathlib import Path
from uuid import UUID

import duckdb
import pytest
from support.ingested import contents

from msgflow import open_db
from msgflow.ingest import ingest
from msgflow.trace import open as open_traces

OTHER = UUID(int=0x2A)
# What says which trace something comes from, and ids that follow from the number of events.
PER_TRACE = {"trace", "packet", "run", "finding", "gap", "stamp_clock"}


@pytest.fixture
def twice(trace: Path, tmp_path: Path) -> Path:
    """The trace, and a copy of it as a session of its own would have written it."""
    directory = tmp_path / "sessions"
    shutil.copytree(trace, directory / "first")
    shutil.copytree(trace, directory / "second")
    shutil.rmtree(directory / "first" / "truth")
    shutil.rmtree(directory / "second" / "truth")
    with open_traces([directory / "first"]) as traces:
        uuid = UUID(traces.traces[0].uuid)
    for file in (directory / "second").rglob("*"):
        if file.is_file():
            content = file.read_bytes().replace(uuid.bytes, OTHER.bytes)
            file.write_bytes(content.replace(str(uuid).encode(), str(OTHER).encode()))
    return directory


@pytest.mark.thorough
def test_nothing_is_counted_twice(database: Path, twice: Path, tmp_path: Path) -> None:
    report = ingest([twice], tmp_path / "twice.duckdb")
    both = contents(tmp_path / "twice.duckdb")
    once = contents(database)
    for table in once.keys() - PER_TRACE:
        assert len(both[table]) == len(once[table]), table
    (found,) = (d for d in report.findings if d.name == "overlapping_traces")
    with duckdb.connect(str(database), read_only=True) as connection:
        ((loaded,),) = connection.execute("SELECT event_count FROM store.run").fetchall()
    assert found.severity == "warning"
    assert 0 < found.count <= loaded
    with open_db(tmp_path / "twice.duckdb") as opened:
        assert opened.check() == []
