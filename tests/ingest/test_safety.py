"""Whatever happens in the middle of an ingest: the database is as it was, or complete."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from support.ingested import contents
from support.thorough import few

from msgflow.db.workspace import workspace
from msgflow.ingest import ingest
from msgflow.ingest import ingest as ingest_function
from msgflow.ingest.staging import RawTables


class Interruption(BaseException):
    """Like KeyboardInterrupt, but nobody else raises it."""


def fail(*_: object, **__: object) -> Any:
    raise Interruption


def fail_while_reading(monkeypatch: pytest.MonkeyPatch) -> None:
    """After some batches, so that there is something to undo."""
    add = RawTables.add
    left = iter(range(4))

    def add_some(*arguments: Any) -> None:
        if next(left, None) is None:
            raise Interruption
        add(*arguments)

    monkeypatch.setattr(RawTables, "add", add_some)


def fail_at(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    module = sys.modules[ingest_function.__module__]
    monkeypatch.setattr(module, name, fail)


FAILURES = {
    "reading": fail_while_reading,
    "storing": lambda monkeypatch: fail_at(monkeypatch, "store_run"),
    "linking": lambda monkeypatch: fail_at(monkeypatch, "derive"),
}


@pytest.mark.parametrize("where", few(FAILURES, "storing"))
def test_a_failure_leaves_the_database_as_it_was(
    database: Path, other_trace: Path, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    before = contents(database)
    FAILURES[where](monkeypatch)
    with pytest.raises(Interruption):
        ingest([other_trace], database)
    assert contents(database) == before
    assert os.listdir(database.parent) == [database.name]


@pytest.mark.parametrize("where", ["reading", "linking"])
def test_a_failure_leaves_no_new_database(
    new_database: Path, trace: Path, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    FAILURES[where](monkeypatch)
    with pytest.raises(Interruption):
        ingest([trace], new_database)
    assert os.listdir(new_database.parent) == []


@pytest.mark.thorough
def test_a_failing_replacement_keeps_the_run(
    database: Path, trace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = contents(database)
    FAILURES["linking"](monkeypatch)
    with pytest.raises(Interruption):
        ingest([trace], database, replace=True)
    assert contents(database) == before


_KILLED = """
import sys, time
import msgflow.ingest
module = sys.modules[msgflow.ingest.ingest.__module__]
derive = module.derive
def stop(con, run_id, **options):
    derive(con, run_id, **options)
    print("derived", flush=True)
    time.sleep(60)
module.derive = stop
msgflow.ingest.ingest([sys.argv[1]], module.Path(sys.argv[2]))
"""


def start_and_kill(trace: Path, *databases: Path) -> None:
    """Ingest into each database, and kill that when everything is done but to commit."""
    started: list[subprocess.Popen[bytes]] = [
        subprocess.Popen(
            [sys.executable, "-c", _KILLED, str(trace), str(database)], stdout=subprocess.PIPE
        )
        for database in databases
    ]
    try:
        for process in started:
            assert process.stdout is not None
            assert process.stdout.readline() == b"derived\n"
    finally:
        for process in started:
            process.kill()
            process.communicate()


@pytest.mark.thorough
def test_a_killed_ingest_is_forgotten(
    database: Path, trace: Path, other_trace: Path, tmp_path: Path
) -> None:
    """The old content can be read at once; the next ingest removes what was left."""
    absent = tmp_path / "absent" / "msgflow.duckdb"
    absent.parent.mkdir()
    before = contents(database)
    start_and_kill(other_trace, database, absent)
    for path in (database, absent):
        left = [name for name in os.listdir(path.parent) if name.startswith(".msgflow-")]
        assert left, "the kill came too early or too late to show anything"
    assert not absent.exists()
    assert contents(database) == before
    assert ingest([other_trace], database).run_id == 2
    assert ingest([trace], absent).run_id == 1
    for path in (database, absent):
        assert os.listdir(path.parent) == [path.name]


@pytest.mark.thorough
def test_the_workspace_of_a_running_ingest_is_left_alone(database: Path, other_trace: Path) -> None:
    """One whose lock nobody holds goes, whatever is in it."""
    with workspace(database) as running:
        (running / "raw.duckdb").write_bytes(b"half")
        abandoned = running.with_name(".msgflow-ingest-abandoned")
        shutil.copytree(running, abandoned)
        abandoned.with_suffix(".lock").touch()
        abandoned.with_suffix(".lock").touch()
        ingest([other_trace], database)
        assert (running / "raw.duckdb").read_bytes() == b"half"
        assert not abandoned.exists()
    assert os.listdir(database.parent) == [database.name]


def test_errors_of_the_ingest_itself_are_not_those_of_its_workspace(new_database: Path) -> None:
    with pytest.raises(PermissionError, match="the trace"), workspace(new_database):
        raise PermissionError("the trace")
    assert os.listdir(new_database.parent) == []
