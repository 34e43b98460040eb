"""Files and disks at fault: said as such, with exit code 4, and the database is as it was."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import duckdb
import pytest
from support.thorough import few, thorough

import msgflow
from msgflow.db import migration
from msgflow.db.sandbox import open_file
from msgflow.errors import DatabaseError, ExitCode
from msgflow.export.flow import Flow
from msgflow.ingest import ingest
from msgflow.sql.failure import in_words

PATH = Path("some.duckdb")


@pytest.fixture
def ingested(simulated: Callable[..., Path]) -> Path:
    return simulated("pipeline", 0.01)


@pytest.fixture
def trace(ingested: Path) -> Path:
    return ingested.parent / "trace"


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Callable[[int], Path]]:
    """A directory on a disk of its own, of so many MB; only root can make one."""
    directory = tmp_path / "disk"
    directory.mkdir()

    def make(megabytes: int) -> Path:
        command = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(directory)]
        if os.name == "nt" or shutil.which("mount") is None:
            pytest.skip("no small disk can be made here")
        if subprocess.run(command, capture_output=True, check=False).returncode:
            pytest.skip("only root may mount a small disk")
        return directory

    yield make
    subprocess.run(["umount", str(directory)], capture_output=True, check=False)


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (duckdb.IOException("IO Error: Could not write: No space left on device"), "no space left"),
        (duckdb.TransactionException("Failed to commit: No space left on device"), "no space left"),
        (
            duckdb.OutOfMemoryException("… limit was set by the 'max_temp_directory_size' setting"),
            "no space left",
        ),
        (OSError(28, "No space left on device"), "no space left"),
        (duckdb.IOException("Cannot open file: Permission denied"), "cannot write beside"),
        (duckdb.Error("Corrupt database file: computed checksum 1"), "is damaged: Corrupt"),
        (duckdb.InternalException("INTERNAL Error: index out of range\nstack"), "damaged: index"),
        (duckdb.InternalException("INTERNAL Error: dict-surviving cache: x"), "made a mistake"),
        (
            duckdb.FatalException("FATAL Error: invalidated. Original error: dict-surviving x"),
            "made a mistake: invalidated",
        ),
        (duckdb.FatalException("FATAL Error: invalidated"), "is damaged: invalidated"),
        (duckdb.SerializationException("Failed to deserialize"), "is damaged"),
    ],
)
def test_each_has_its_words(error: Exception, text: str) -> None:
    words = in_words(error, PATH)
    assert words is not None
    assert text in words.message
    assert words.message.endswith(f"— {PATH}")
    assert words.hint
    assert words.exit_code == ExitCode.DATABASE


@pytest.mark.parametrize(
    "error",
    [
        duckdb.ConversionException("Could not convert string 'no space left' to INT32"),
        duckdb.OutOfMemoryException("failed to allocate data of size 3 GiB"),
        duckdb.InterruptException("INTERRUPT Error: Interrupted!"),
        OSError(2, "No such file"),
    ],
)
def test_statements_at_fault_are_left_alone(error: Exception) -> None:
    assert in_words(error, PATH) is None


def damage(path: Path) -> None:
    """Change a bit in every block behind the first headers."""
    content = bytearray(path.read_bytes())
    for at in range(3 * 4096 + 100_000, len(content), 262_144):
        content[at] ^= 1
    path.write_bytes(content)


def test_damage_is_said_by_all_that_meet_it(ingested: Path, tmp_path: Path) -> None:
    path = tmp_path / "damaged.duckdb"
    shutil.copyfile(ingested, path)
    damage(path)
    messages = []
    for use in (
        lambda: msgflow.open_db(path).query("e2e-latency"),
        lambda: msgflow.open_db(path).sql("SELECT sum(hash(i)) FROM callback_instance AS i"),
        lambda: msgflow.open_db(path).check(),
        lambda: msgflow.open_db(path).findings(),
        lambda: msgflow.open_db(path).apply_clocks("messages"),
        lambda: migration.upgrade(path),
    ):
        with contextlib.suppress(DatabaseError):
            messages.append("none")
            use()
            continue
        messages[-1] = "said"
    assert messages.count("said") >= 4


@pytest.mark.parametrize(
    ("place", "ask"),
    [
        ("query.notes.clock_verdicts", lambda database, _: database.clock_verdicts()),
        ("view.report.write_report", lambda database, _: database.report("x.html")),
        ("view.flow_page.write_flow_page", lambda database, flow: database.flow_page(flow, "x")),
    ],
)
def test_damage_is_said_wherever_it_is_met(
    ingested: Path,
    monkeypatch: pytest.MonkeyPatch,
    place: str,
    ask: Callable[[msgflow.Database, Flow], object],
) -> None:
    def meet(*_: object, **__: object) -> None:
        raise duckdb.Error("Corrupt database file: computed checksum 1")

    monkeypatch.setattr(f"msgflow.{place}", meet)
    with msgflow.open_db(ingested) as database:
        flow = database.flow(publication_id=1)
        with pytest.raises(DatabaseError, match="the database is damaged"):
            ask(database, flow)


@pytest.mark.parametrize(
    "statement",
    [
        "DELETE FROM store.alembic_version",
        "UPDATE store.alembic_version SET version_num = ''",
        thorough("UPDATE store.alembic_version SET version_num = '0000'"),
        thorough("UPDATE store.alembic_version SET version_num = 'x' || repeat('y', 1000)"),
        "DROP TABLE store.alembic_version;"
        " CREATE TABLE store.alembic_version AS SELECT NULL::VARCHAR AS version_num",
        "DROP TABLE store.alembic_version; CREATE TABLE store.alembic_version (a INT)",
    ],
)
def test_a_database_without_a_revision_is_foreign(small_database: Path, statement: str) -> None:
    with duckdb.connect(str(small_database)) as con:
        con.execute(statement)
    for use in (
        lambda: msgflow.open_db(small_database).runs(),
        lambda: migration.upgrade(small_database),
    ):
        with pytest.raises(DatabaseError) as raised:
            use()
        assert len(raised.value.message) < 300 + len(str(small_database))


@pytest.mark.parametrize("kind", ["pipe", "directory", "device"])
def test_what_is_no_file_is_not_opened(tmp_path: Path, trace: Path, kind: str) -> None:
    path = tmp_path / "no.duckdb"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "directory":
        path.mkdir()
    else:
        path = Path(os.devnull)
    for use in (
        lambda: msgflow.open_db(path).runs(),
        lambda: migration.upgrade(path),
        lambda: ingest([trace], path),
    ):
        with pytest.raises(DatabaseError, match="not a database file but a "):
            use()


def test_a_full_disk_after_the_commit_is_a_warning(
    ingested: Path, trace: Path, small_disk: Callable[[int], Path]
) -> None:
    """The run is in the log, and is read from there."""
    path = small_disk(ingested.stat().st_size // 1_000_000 + 2) / "a.duckdb"
    shutil.copyfile(ingested, path)
    report = ingest([trace], path, name="again", replace=True)
    assert len(report.warnings) == 1
    assert "the run is stored" in report.warnings[0]
    assert "no space left on the disk" in report.warnings[0]
    with msgflow.open_db(path) as database:
        assert [run.name for run in database.runs()] == ["again"]
        assert database.check() == []
    assert sorted(os.listdir(path.parent)) == ["a.duckdb", "a.duckdb.wal"]


@pytest.mark.parametrize("megabytes", few([1, 4], 1))
def test_a_full_disk_leaves_no_new_database(
    trace: Path, small_disk: Callable[[int], Path], megabytes: int
) -> None:
    path = small_disk(megabytes) / "new.duckdb"
    with pytest.raises(DatabaseError, match="no space left on the disk") as raised:
        ingest([trace], path)
    assert raised.value.hint is not None
    assert os.listdir(path.parent) == []


def test_a_full_disk_leaves_the_old_database(
    ingested: Path, trace: Path, small_disk: Callable[[int], Path]
) -> None:
    path = small_disk(ingested.stat().st_size // 1_000_000 + 2) / "a.duckdb"
    shutil.copyfile(ingested, path)
    with contextlib.suppress(OSError), (path.parent / "full").open("wb", buffering=0) as full:
        while True:
            full.write(bytes(4096))
    with pytest.raises(DatabaseError, match="no space left on the disk"):
        ingest([trace], path, name="again", replace=True)
    (path.parent / "full").unlink()
    assert path.read_bytes() == ingested.read_bytes()
    assert os.listdir(path.parent) == ["a.duckdb"]


def test_a_connection_spills_beside_its_database(small_database: Path) -> None:
    with open_file(small_database, read_only=True) as con:
        ((place,),) = con.execute("SELECT current_setting('temp_directory')").fetchall()
    assert Path(place).parent == small_database.parent
    assert not Path(place).exists()
