"""What killed processes leave behind goes with the next command; what is in use stays."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import msgflow
from msgflow.db.connection import connect, expected_definitions
from msgflow.db.sandbox import spill_directory
from msgflow.db.workspace import creating, workspace
from msgflow.errors import DatabaseError
from msgflow.files import temporary_owner
from msgflow.files.atomic import replacing
from msgflow.ingest import ingest
from msgflow_sim import simulate


def dead_mark() -> str:
    """Return the mark of a process that has ended."""
    program = "from msgflow.files.temporary_owner import mark; print(mark())"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_definitions_that_a_killed_command_read_go_with_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / f"msgflow-definitions-{dead_mark()}.abc").mkdir()
    expected_definitions.cache_clear()
    assert expected_definitions()
    assert not list(tmp_path.glob("msgflow-definitions-*"))


def test_a_mark_is_abandoned_with_its_process() -> None:
    place, pid, start = temporary_owner.mark().split("-")
    assert not temporary_owner.is_abandoned(temporary_owner.mark())
    assert temporary_owner.is_abandoned(dead_mark())
    assert temporary_owner.is_abandoned(f"{place}-{pid}-{int(start) + 1}")  # another process, later
    assert not temporary_owner.is_abandoned(f"{'f' * 12}-{pid}-1")  # of another machine
    assert not temporary_owner.is_abandoned("something else")


def spilled(database: Path, mark: str) -> Path:
    directory = database.with_name(f".{database.name}.{mark}.spill")
    directory.mkdir()
    (directory / "duckdb_temp_storage_DEFAULT-0.tmp").write_bytes(b"spilled")
    return directory


def test_what_the_dead_spilled_is_removed(small_database: Path) -> None:
    dead = spilled(small_database, dead_mark())
    elsewhere = spilled(small_database, f"{'f' * 12}-1-1")
    own = spilled(small_database, temporary_owner.mark())
    mine = small_database.with_name(f".{small_database.name}.mine")
    mine.touch()
    msgflow.open_db(small_database).runs()
    assert (dead.exists(), elsewhere.exists(), own.exists()) == (False, True, True)
    # Who may write has the database alone.
    connect(small_database, read_only=False).close()
    assert (elsewhere.exists(), own.exists(), mine.exists()) == (False, True, True)


def test_what_takes_more_than_memory_spills_beside_the_database(small_database: Path) -> None:
    """Its answer is whole, and nothing is left."""
    before = set(os.listdir(small_database.parent))
    with msgflow.open_db(small_database, memory_limit="60MB") as database:
        rows = database.sql(
            "SELECT count(*) AS n FROM (SELECT hash(range) AS h FROM range(4000000) ORDER BY h)"
        )
        assert rows.to_arrow().to_pylist() == [{"n": 4_000_000}]
        inside = {*os.listdir(small_database.parent)} - before
        assert inside <= {spill_directory(small_database).name}
    assert set(os.listdir(small_database.parent)) == before


def test_abandoned_workspaces_go_with_any_command(small_database: Path) -> None:
    with workspace(small_database) as running:
        abandoned = running.with_name(f".msgflow-{'0' * 32}")
        # That of a user, whose database `notes` was being created when the process was killed.
        mine = running.with_name(".msgflow-notes")
        for directory in (abandoned, mine):
            directory.mkdir()
            directory.with_suffix(".lock").touch()
        msgflow.open_db(small_database).runs()
        assert (running.exists(), abandoned.exists(), mine.exists()) == (True, False, True)
        assert not abandoned.with_suffix(".lock").exists()


def test_a_lock_is_no_link(tmp_path: Path) -> None:
    (tmp_path / ".msgflow-new.duckdb.lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(DatabaseError, match="cannot write"), creating(tmp_path / "new.duckdb"):
        pass
    assert not (tmp_path / "elsewhere").exists()


def test_the_second_to_create_a_database_learns_it_at_once(tmp_path: Path) -> None:
    path = tmp_path / "db" / "new.duckdb"
    path.parent.mkdir()
    trace = simulate("pipeline", tmp_path / "trace", factor=0.01).directory
    with (
        creating(path),
        pytest.raises(DatabaseError, match=rf"\(process {os.getpid()}: .* is creating"),
    ):
        ingest([trace], path)
    with creating(path):
        pass
    assert os.listdir(path.parent) == []


def test_parts_of_files_of_the_dead_are_removed(tmp_path: Path) -> None:
    path = tmp_path / "out.csv"
    dead, other = (path.with_name(f".out.csv.{mark}.part") for mark in (dead_mark(), "mine"))
    dead.touch()
    other.touch()
    with replacing(path) as temporary:
        temporary.write_text("new")
    assert sorted(os.listdir(tmp_path)) == sorted([other.name, "out.csv"])


def test_an_export_puts_back_what_a_killed_one_moved_away(
    small_database: Path, tmp_path: Path
) -> None:
    directory = tmp_path / "export"
    old = directory / f".export.{dead_mark()}.part" / "old"
    old.mkdir(parents=True)
    (old / "mine.csv").write_text("before")
    (old / "host.csv").write_text("before")
    (directory / "host.csv").write_text("after")
    with msgflow.open_db(small_database) as database:
        database.export_csv(directory, ["node"])
    assert sorted(os.listdir(directory)) == ["host.csv", "mine.csv", "node.csv"]
    assert (directory / "mine.csv").read_text() == "before"
    assert (directory / "host.csv").read_text() == "after"


@pytest.mark.parametrize("link", [".export.{}.part", ".export.{}.part/old"])
def test_an_export_puts_nothing_back_from_behind_a_link(
    small_database: Path, tmp_path: Path, link: str
) -> None:
    mine = tmp_path / "mine"
    (mine / "old").mkdir(parents=True)
    for place in (mine, mine / "old"):
        (place / "letter.txt").write_text("precious")
    at = tmp_path / "export" / link.format(dead_mark())
    at.parent.mkdir(parents=True)
    at.symlink_to(mine)
    with msgflow.open_db(small_database) as database:
        database.export_csv(tmp_path / "export", ["node"])
    assert len(list(mine.rglob("letter.txt"))) == 2
