"""A trace without events is a finding if others have some. A copy that is not read is not."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from support.ingested import contents

from msgflow.db.connection import connect
from msgflow.db.finding import read_findings
from msgflow.ingest import ingest


def empty_traces(database: Path) -> list[str]:
    with connect(database, read_only=True) as connection:
        return [f.subject for f in read_findings(connection, [1]) if f.name == "empty_trace"]


@pytest.mark.thorough
def test_metadata_alone_and_a_copy(
    trace: Path, tmp_path: Path, new_database: Path, database: Path
) -> None:
    """Packets given twice are read once."""
    alone = tmp_path / "alone"
    alone.mkdir()
    shutil.copy(next(trace.rglob("metadata")), alone)
    report = ingest([trace, shutil.copytree(trace, tmp_path / "copy"), alone], new_database)
    found = {d.name: d for d in report.findings}
    assert (found["empty_trace"].severity, found["empty_trace"].count) == ("warning", 1)
    assert empty_traces(new_database) == [str(alone)]
    assert found["duplicate_packet"].count > 0
    once, twice = contents(database), contents(new_database)
    for table in ("publication", "take", "callback_instance", "link_transport", "link_causal"):
        assert len(twice[table]) == len(once[table]) > 0
