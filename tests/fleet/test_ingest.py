"""Every recording goes in as it would alone, and what fails is noted while the rest goes on."""

from __future__ import annotations

import json
import os
import shutil
import signal
import stat
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import duckdb
import pyarrow as pa
import pytest
from support.ingested import made_once
from typer.testing import CliRunner, Result

from msgflow import Database
from msgflow.cli.app import app
from msgflow.errors import DatabaseError, UsageError
from msgflow.fleet import child_process
from msgflow.fleet import task as task_module
from msgflow.fleet.ingest import fleet_ingest
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import database_path, part_path
from msgflow.fleet.sources import State
from msgflow.fleet.task import PASSING, Options, Outcome, Task, needs, without_secrets
from msgflow.fleet.workers import OneProcess
from msgflow.sql.failure import out_of_memory
from msgflow_sim import simulate

_LENGTH = 0.05


@dataclass(frozen=True)
class Filled:
    """A lake, and what was put into it.

    Attributes:
        lake: address of the lake.
        recordings: the folder of the recordings.
        manifest: the list of them.
        result: of the command.
    """

    lake: Path
    recordings: Path
    manifest: Path
    result: Result


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["fleet", *map(str, arguments)])


# Of the session, as a worker may come back to this module.
@pytest.fixture(scope="session")
def filled(databases: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Filled:
    recordings = databases[0].parent / "recordings"
    manifest = recordings.parent / "night.csv"

    def make(_: Path) -> None:
        (recordings / "broken").mkdir()
        (recordings / "broken" / "metadata").write_text("no metadata")
        manifest.write_text(
            "path,robot,software_version\n"
            'recordings/r0,"the ""first"", or\nr0",1.1\n'
            "recordings/broken,r2,1.1\n"
            "recordings/missing,r3,1.1\n"
        )

    made_once(tmp_path_factory, "night", make)
    folder = tmp_path_factory.mktemp("filled")
    scratch = folder / "scratch"
    result = run(
        "ingest", manifest, "--lake", folder / "lake", "--scratch", scratch, "--label", "site=x"
    )
    assert not list(scratch.iterdir())
    return Filled(folder / "lake", recordings, manifest, result)


def failures(lake: Path) -> dict[str, dict[str, Any]]:
    rows = Lake.open(lake).failures().to_pylist()
    return {Path(row["source"]).name: row for row in rows}


def test_what_can_goes_in_and_the_rest_is_said(filled: Filled) -> None:
    assert filled.result.exit_code == 1
    assert filled.result.stdout == ""
    assert "3 recordings for" in filled.result.stderr
    assert "1 added, 2 failed" in filled.result.stderr
    (added,) = Lake.open(filled.lake).runs().to_pylist()
    assert dict(added["labels"]) == {
        "robot": 'the "first", or\nr0',
        "software_version": "1.1",
        "site": "x",
    }
    assert (added["name"], added["source"]) == ("r0", str(filled.recordings / "r0"))
    failed = failures(filled.lake)
    assert {name: (row["reason"], row["tries"]) for name, row in failed.items()} == {
        "broken": ("broken", 1),
        "missing": ("broken", 1),
    }
    assert failed["broken"]["stage"] == "ingesting"
    assert dict(failed["broken"]["labels"])["robot"] == "r2"
    listed = json.loads(run("failures", "--lake", filled.lake, "--format", "json").stdout)
    assert len(listed) == 2
    assert 'robot=the "first"' in run("runs", "--lake", filled.lake).stdout


def test_a_run_is_what_its_recording_gives_alone(
    filled: Filled, databases: tuple[Path, Path], tmp_path: Path
) -> None:
    lake = Lake.open(filled.lake)
    for run_row in lake.runs().to_pylist():
        alone = databases[0]
        database = lake.store.read(database_path(run_row["database_part"]))
        assert database is not None
        back = tmp_path / "back.duckdb"
        with pa.CompressedInputStream(pa.BufferReader(database), "zstd") as stream:
            back.write_bytes(stream.read())
        with duckdb.connect() as con:
            con.execute(f"ATTACH '{alone}' AS alone (READ_ONLY)")
            con.execute(f"ATTACH '{back}' AS back (READ_ONLY)")
            tables = con.execute(
                "SELECT table_name FROM duckdb_tables() WHERE database_name = 'alone' "
                "AND schema_name = 'store' AND table_name <> 'run' ORDER BY 1"
            ).fetchall()
            assert len(tables) > 30
            for (table,) in tables:
                (counts,) = con.execute(
                    f"SELECT (SELECT count(*) FROM alone.store.{table}), count(*) FROM "
                    f"(FROM alone.store.{table} INTERSECT ALL FROM back.store.{table})"
                ).fetchall()
                assert counts[0] == counts[1], table
            con.execute("DETACH back")
        part = run_row["part"]
        with Database(alone) as opened:
            for query in ("callbacks", "topics-delivery"):
                path = part_path(query.replace("-", "_"), part)
                expected = opened.query(query, internal=True).to_arrow().to_pylist()
                found = duckdb.sql(f"FROM read_parquet('{filled.lake}/{path}')").to_arrow_table()
                assert [
                    {k: v for k, v in row.items() if k not in ("run", "part")}
                    for row in found.to_pylist()
                ] == [{k: v for k, v in row.items() if k != "run_id"} for row in expected]


def test_started_again_it_does_what_is_left(filled: Filled, tmp_path: Path) -> None:
    lake = tmp_path / "lake"
    shutil.copytree(filled.lake, lake)
    # Fewer are asked for than went in: those need no worker.
    again = run("ingest", filled.recordings / "r[0]", "--lake", lake)
    assert again.exit_code == 0
    assert "1 there before" in again.stderr
    before = failures(lake)
    whole = run("ingest", filled.manifest, "--lake", lake, "--label", "site=x")
    assert whole.exit_code == 1
    assert "1 there before, 1 failed, 1 failed before" in whole.stderr
    assert failures(lake)["broken"] == before["broken"]
    # With other labels the answers stay, and are said to be of something else.
    parts = {row["part"] for row in Lake.open(lake).runs().to_pylist()}
    assert (
        run("ingest", filled.recordings / "r0", "--lake", lake, "--label", "robot=z").exit_code == 0
    )
    labelled = Lake.open(lake).runs().to_pylist()
    assert {row["part"] for row in labelled} == parts
    assert ("robot", "z") in [pair for row in labelled for pair in row["labels"]]


@pytest.mark.thorough
def test_what_was_mended_is_tried_again(
    filled: Filled, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def here(task: Task) -> Outcome:
        with TemporaryDirectory() as directory:
            return child_process.do(task, Path(directory))

    # That each has a process of its own is shown by the other tests.
    monkeypatch.setattr("msgflow.fleet.workers.run_task", here)
    lake, recordings = tmp_path / "lake", tmp_path / "recordings"
    shutil.copytree(filled.lake, lake)
    shutil.copytree(filled.recordings / "broken", recordings / "broken")
    sources = (recordings / "broken", "--lake", lake, "--no-database")
    assert run("ingest", *sources).exit_code == 3
    assert run("ingest", *sources).exit_code == 3
    shutil.rmtree(recordings / "broken")
    # A mended source looks like another recording, so that it is tried without an option.
    simulate("pipeline", recordings / "broken", factor=_LENGTH, seed=9)
    mended = run("ingest", *sources)
    assert mended.exit_code == 0, mended.stderr
    assert str(recordings / "broken") not in {
        row["source"] for row in Lake.open(lake).failures().to_pylist()
    }
    # The source of a run that holds something else now takes the place of that run.
    (first,) = (r for r in Lake.open(lake).runs().to_pylist() if r["name"] == "broken")
    shutil.rmtree(recordings / "broken")
    simulate("pipeline", recordings / "broken", factor=_LENGTH, seed=10)
    assert "1 replaced" in run("ingest", *sources).stderr
    (second,) = (r for r in Lake.open(lake).runs().to_pylist() if r["name"] == "broken")
    assert first["run"] != second["run"]
    assert len(Lake.open(lake).runs()) == 2


@pytest.fixture
def task(filled: Filled) -> Task:
    return Task(str(filled.recordings / "r0"), str(filled.lake), database=False)


def outcome(task: Task, **more: Any) -> Outcome:
    return task_module.run_task(replace(task, **more))


def test_what_hangs_or_grows_is_ended(task: Task, tmp_path: Path) -> None:
    late = outcome(task, timeout=0.2, scratch=str(tmp_path))
    assert (late.reason, late.values) == ("timeout", None)
    assert late.error.startswith("not done after 0.2 s")
    large = outcome(task, memory=20_000_000, scratch=str(tmp_path))
    assert large.reason == "too_large"
    assert "may take 20,000,000" in large.error
    full = outcome(task, needed_disk=10**18, scratch=str(tmp_path))
    assert (full.reason, full.stage) == ("no_space", "looking at the source")
    no_folder = tmp_path / "file"
    no_folder.write_text("")
    assert outcome(task, scratch=str(no_folder)).reason == "no_scratch"
    assert list(tmp_path.iterdir()) == [no_folder]


def test_a_process_that_dies_is_said(
    task: Task, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = tmp_path / "python"
    script.write_text("#!/bin/sh\necho 'the last words' >&2\nkill -9 $$\n")
    script.chmod(script.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(sys, "executable", str(script))
    died = outcome(task, scratch=str(tmp_path / "scratch"))
    assert died.reason == "crashed"
    assert died.error == f"the process ended with signal {signal.SIGKILL:d}: the last words"
    assert not list((tmp_path / "scratch").iterdir())


def test_a_source_that_changes_while_it_is_read(
    task: Task, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "r0"
    shutil.copytree(task.source, source)
    look = child_process.look_at

    def then_it_grows(url: str) -> State:
        state = look(url)
        (source / "more").write_text("more")
        return state

    monkeypatch.setattr(child_process, "look_at", then_it_grows)
    (tmp_path / "scratch").mkdir()
    changed = child_process.do(replace(task, source=str(source)), tmp_path / "scratch")
    assert (changed.reason, changed.stage) == ("changed", "looking at the source again")


def test_a_disk_that_fills_is_said(
    task: Task, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fill(*_: object, **__: object) -> None:
        raise duckdb.IOException("Could not write file: No space left on device")

    before = Lake.open(task.lake).runs()
    monkeypatch.setattr(Database, "ingest", fill)
    full = child_process.do(task, tmp_path)
    assert (full.reason, full.stage, full.values) == ("no_space", "ingesting", None)
    assert full.reason in PASSING
    assert Lake.open(task.lake).runs().equals(before)


class Fake(OneProcess):
    """Does no work, but says what came of it."""

    def __init__(self, *outcomes: Outcome) -> None:
        super().__init__()
        self.outcomes = list(outcomes)
        self.tasks: list[Task] = []

    def wait(self, seconds: float) -> Any:
        while self._tasks:
            self.tasks.append(self._tasks.pop(0))
            yield self.tasks[-1], self.outcomes.pop(0)


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Fake]:
    def install(*outcomes: Outcome) -> Fake:
        workers = Fake(*outcomes)
        monkeypatch.setattr("msgflow.fleet.ingest.make_workers", lambda _: workers)
        return workers

    return install


def test_what_may_pass_is_tried_again(
    fake: Callable[..., Fake], filled: Filled, tmp_path: Path
) -> None:
    source = str(filled.recordings / "r0")
    lost = Outcome(reason="worker_lost", error="gone")
    for outcomes, tries, failed in (
        ((lost, lost, Outcome(reason="unreachable")), 3, ["unreachable"]),
        ((lost, Outcome(reason="broken")), 2, ["broken"]),
        ((Outcome(reason="timeout"),), 1, ["timeout"]),
    ):
        workers = fake(*outcomes)
        lake = tmp_path / str(tries)
        done = fleet_ingest([source], lake)
        assert [reason for _, reason, _ in done.failures] == failed
        assert len(workers.tasks) == tries
        (row,) = Lake.open(lake).failures().to_pylist()
        assert row["tries"] == tries
        # Left alone, until somebody asks for it.
        assert fleet_ingest([source], lake).failed_before == 1
        fake(Outcome(reason="broken"))
        assert fleet_ingest([source], lake, options=Options(retry_failed=True)).failed == 1


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        duckdb.OutOfMemoryException("Out of Memory Error: no"),
        out_of_memory("q"),
        DatabaseError("the traces need more memory than 1GB", ""),
    ],
)
def test_too_little_memory_is_told_from_other_errors(error: Exception) -> None:
    assert child_process.failed_outcome(error, "answers").reason == "too_large"
    assert (
        child_process.failed_outcome(UsageError("no such query"), "answers").reason != "too_large"
    )


def test_what_no_worker_has_is_not_tried(filled: Filled, tmp_path: Path) -> None:
    big = tmp_path / "big.tar.zst"
    with big.open("wb") as file:
        os.truncate(file.fileno(), 10**12)
    done = fleet_ingest([str(big)], tmp_path / "lake")
    ((_, reason, error),) = done.failures
    assert reason == "too_large"
    assert "the largest worker has" in error
    memory, disk = needs(10**9, is_archive=False, is_remote=False)
    assert needs(10**9, is_archive=False, is_remote=True) == (memory, disk + 10**9)
    assert needs(10**9, is_archive=True, is_remote=False)[0] > memory


def test_nothing_is_changed_where_it_cannot_begin(filled: Filled, tmp_path: Path) -> None:
    newer = tmp_path / "newer"
    newer.mkdir()
    (newer / "lake.json").write_text('{"format": "msgflow lake", "revision": 99}')
    source = str(filled.recordings / "r0")
    with pytest.raises(DatabaseError, match="newer than this msgflow"):
        fleet_ingest([source], newer)
    assert run("ingest", source, "--lake", newer).exit_code == 4
    assert [path.name for path in newer.iterdir()] == ["lake.json"]
    lake = tmp_path / "lake"
    with pytest.raises(UsageError):
        fleet_ingest(["s3://k:s@bucket/x"], lake)
    assert run("ingest", source, "--lake", lake, "--label", "robot").exit_code == 2
    assert run("ingest", source, "--lake", lake, "--timeout", "soon").exit_code == 2
    assert run("ingest", source, "--lake", lake, "--memory", "much").exit_code == 2
    assert not lake.exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_lake_that_cannot_be_written(filled: Filled, tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(DatabaseError, match="cannot write to the store: Permission denied"):
        fleet_ingest([str(filled.recordings / "r0")], tmp_path / "lake")


def test_a_lake_where_nobody_may_write(filled: Filled) -> None:
    """Not even root: the kernel makes no folders there."""
    source = filled.recordings / "r0"
    result = run("ingest", source, "--lake", "/proc/lake")
    assert result.exit_code == 4
    assert "cannot write to the store" in result.stderr


def test_a_lake_that_cannot_be_reached(filled: Filled, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    monkeypatch.setattr("msgflow.fleet.file_store.MOST_ATTEMPTS", 1)
    result = run("ingest", filled.recordings / "r0", "--lake", "s3://fleet/lake")
    assert result.exit_code == 4
    assert "cannot read the store" in result.stderr


def test_secrets_are_in_no_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "hush-hush")
    assert without_secrets("denied for hush-hush") == "denied for …"
    given = asdict(Task("s3://bucket/x", "s3://bucket/lake"))
    assert "hush" not in json.dumps(given)


def test_without_ray_it_is_said_how_to_get_it(
    filled: Filled, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(UsageError, match="Ray is not installed"):
        fleet_ingest([str(filled.recordings / "r0")], tmp_path / "lake", ray="local")
