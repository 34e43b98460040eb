"""Runs and their sources, when sources change or have equal packets, or others write meanwhile.

A recording here is a folder with a file that names its packets; it is not really ingested.
"""

from __future__ import annotations

import itertools
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from msgflow.cli.app import app
from msgflow.errors import UsageError
from msgflow.fleet import ingest as fleet_ingest_module
from msgflow.fleet import task as task_module
from msgflow.fleet import workers
from msgflow.fleet.file_store import Store, normal_url
from msgflow.fleet.ingest import FleetProgress, fleet_ingest, is_in_shard
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import new_part
from msgflow.fleet.sources import look_at
from msgflow.fleet.task import Options, Outcome, Task

BROKEN = "broken"


def run_task(task: Task) -> Outcome:
    """Return what a worker would say, without doing anything."""
    key = (Path(task.source) / "packets").read_text()
    if key == BROKEN:
        return Outcome(reason="broken", stage="ingesting", error="no trace")
    values = {
        "run": key,
        "part": new_part(key),
        "name": Path(task.source).name,
        "source": task.source,
        "source_signature": look_at(task.source).signature,
        "options": json.dumps(task.ingest, sort_keys=True),
        "event_count": 1,
        "schema_revision": "",
    }
    return Outcome(values=values)


@pytest.fixture(autouse=True)
def no_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "run_task", run_task)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def record(name: str, packets: str) -> str:
    Path(name).mkdir(exist_ok=True)
    Path(name, "packets").write_text(packets)
    # A change within a tick of the clock shows as well.
    os.utime(Path(name, "packets"), ns=(0, sum(map(ord, packets)) * 10**9))
    return name


def ingest(
    *sources: str,
    replace: bool = False,
    labels: dict[str, str] | None = None,
    progress: Callable[[FleetProgress], None] | None = None,
) -> FleetProgress:
    options = Options(database=False, replace=replace)
    return fleet_ingest(sources, "lake", options=options, labels=labels, progress=progress)


def runs() -> dict[str, str]:
    """Return which source each run is of."""
    return {row["run"]: Path(row["source"]).name for row in Lake.open("lake").runs().to_pylist()}


def labels_of(run: str) -> dict[str, str]:
    rows = {row["run"]: row["labels"] for row in Lake.open("lake").runs().to_pylist()}
    return dict(rows[run])


def failures() -> dict[str, str]:
    rows = Lake.open("lake").failures().to_pylist()
    return {Path(row["source"]).name: row["reason"] for row in rows}


@pytest.mark.parametrize("order", [("a", "z"), ("z", "a")])
def test_a_recording_that_was_moved_stays(place: Path, order: tuple[str, str]) -> None:
    ingest(record("z", "first"))
    record("a", "first")
    record("z", "second")
    done = ingest(*order)
    assert runs() == {"first": "a", "second": "z"}
    assert done.in_lake == 2
    assert ingest(*order).there == 2


def test_a_recording_that_becomes_like_another_leaves_nothing(place: Path) -> None:
    ingest(record("a", "first"), record("c", "second"))
    record("a", "second")
    done = ingest("a", "c")
    assert runs() == {"second": "c"}
    assert (done.same, done.there) == (1, 1)


def test_what_a_source_held_before_goes(place: Path) -> None:
    ingest(record("a", "first"))
    done = ingest(record("a", "second"))
    assert runs() == {"second": "a"}
    assert (done.replaced, done.added) == (1, 0)


def test_equal_packets_with_other_labels_are_said_where_runs_are_replaced(place: Path) -> None:
    record("a", "first")
    record("b", "first")
    Path("night.csv").write_text("path,robot\na,A\nb,B\n")
    for replace in (True, False):
        ingest("night.csv", replace=replace)
        assert failures() == {"b": "same_packets"}
        (failed,) = Lake.open("lake").failures().to_pylist()
        assert f"from {place / 'a'}" in failed["error"]
        assert (runs(), labels_of("first")) == ({"first": "a"}, {"robot": "A"})
    # Of different calls, the later one is meant.
    ingest("b", replace=True, labels={"robot": "B"})
    assert (runs(), labels_of("first")) == ({"first": "b"}, {"robot": "B"})


def test_labels_stay_where_none_are_given(place: Path) -> None:
    ingest(record("a", "first"), labels={"robot": "A", "site": "x"})
    ingest("a", replace=True)
    assert labels_of("first") == {"robot": "A", "site": "x"}
    ingest(record("a", "second"))
    assert labels_of("second") == {"robot": "A", "site": "x"}
    ingest("a", labels={"robot": "B"})
    assert labels_of("second") == {"robot": "B"}


def test_what_others_do_meanwhile_stays_done(place: Path) -> None:
    record("a", "first")
    record("b", "second")
    ingest("a", "b")
    removed: list[str] = []

    def remove(progress: FleetProgress) -> None:
        if not removed:
            removed.append("second")
            Lake.open("lake").remove(removed)

    # The second is looked at once the first is done, and has to go in anew.
    done = ingest("a", "b", labels={"robot": "A"}, progress=remove)
    assert (done.there, done.added) == (1, 1)
    assert runs() == {"first": "a", "second": "b"}


def test_labels_are_those_of_the_part_that_counts(place: Path) -> None:
    ingest(record("a", "first"), record("b", "second"))

    def replace(progress: FleetProgress) -> None:
        lake = Lake.open("lake")
        row = lake.run("second")
        if row is not None and row["part"] != "other":
            lake.commit([row | {"part": "other", "labels": {}}])

    ingest("a", "b", labels={"robot": "A"}, progress=replace)
    rows = {row["run"]: row for row in Lake.open("lake").runs().to_pylist()}
    assert rows["second"]["part"] == "other"
    assert labels_of("second") == {"robot": "A"}


def test_what_is_in_the_lake_did_not_fail(place: Path) -> None:
    ingest(record("a", "first"))
    record("a", BROKEN)
    assert ingest("a").failed == 1
    assert failures() == {"a": "broken"}
    # It is as it was before.
    assert ingest(record("a", "first")).there == 1
    assert failures() == {}
    record("a", BROKEN)
    ingest("a")
    assert ingest("a").failed_before == 1
    assert ingest("a", replace=True).failed == 1


def test_what_cannot_be_looked_at_ends_nothing(place: Path) -> None:
    record("a", "first")
    Path("night.csv").write_text("path\nx\0y\na\n")
    done = ingest("night.csv")
    assert (done.added, done.failed) == (1, 1)
    assert set(failures().values()) == {"broken"}


def test_a_link_that_leads_back_is_followed_once(place: Path) -> None:
    record("a", "first")
    before = look_at(str(place / "a"))
    Path("a", "self").symlink_to(".")
    assert look_at(str(place / "a")) == before
    assert ingest("a").added == 1


def test_the_lake_is_no_recording(place: Path) -> None:
    record("a", "first")
    for _ in range(2):
        done = ingest("[al]*")
        assert (done.total, done.in_lake, failures()) == (1, 1, {})
    with pytest.raises(UsageError, match="the lake itself is no recording"):
        ingest("lake/run")


def test_what_others_write_is_read_once(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else two ingests into one lake would read all that is there for each recording."""
    ingest(*(record(f"r{number}", f"run{number}") for number in range(5)))
    read: list[str] = []
    before = Store.read
    monkeypatch.setattr(
        Store, "read", lambda self, path, most=None: read.append(path) or before(self, path, most)
    )
    row = Lake.open("lake").runs().to_pylist()[0]

    def write(progress: FleetProgress) -> None:
        Lake.open("lake").commit([{**row, "run": f"other {progress.done}", "labels": {}}])

    read.clear()
    done = ingest(*(f"r{number}" for number in range(5)), progress=write)
    assert max(read.count(path) for path in set(read) if path.startswith("run/")) == 1
    assert done.there == 5
    assert len(runs()) == 10


def test_of_two_runs_of_a_source_the_earlier_one_goes(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A writer was killed when the new run was there and the earlier one not yet removed."""
    ingest(record("a", "first"))

    def killed(self: Lake, keys: object) -> int:
        raise KeyboardInterrupt

    record("a", "second")
    with monkeypatch.context() as patch:
        patch.setattr(Lake, "remove", killed)
        with pytest.raises(KeyboardInterrupt):
            ingest("a")
    assert runs() == {"first": "a", "second": "a"}
    assert ingest("a").replaced == 1
    assert runs() == {"second": "a"}


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_of_two_shards_with_the_same_packets_one_has_the_run(
    place: Path, monkeypatch: pytest.MonkeyPatch, order: tuple[int, int]
) -> None:
    monkeypatch.setattr(
        fleet_ingest_module, "is_in_shard", lambda source, n, _: source.endswith("az"[n])
    )
    record("a", "first")
    record("z", "first")
    Path("night.csv").write_text("path,robot\na,A\nz,Z\n")
    first, second = ("az"[n] for n in order)
    # A restart of any shard changes nothing.
    for shard in (*order, *order, *reversed(order)):
        fleet_ingest(["night.csv"], "lake", options=Options(database=False), shard=(shard, 2))
    assert runs() == {"first": first}
    assert labels_of("first") == {"robot": first.upper()}
    assert failures() == {second: "same_packets"}


def test_the_run_of_a_source_that_is_gone_is_that_of_its_copy(place: Path) -> None:
    ingest(record("a", "first"), labels={"robot": "A"})
    shutil.move("a", "b")
    assert ingest("b").replaced == 1
    assert (runs(), labels_of("first")) == ({"first": "b"}, {"robot": "A"})
    assert ingest("b").there == 1


def test_scratch_space_that_cannot_be_made_is_not_full(place: Path) -> None:
    Path("file").write_text("")
    task = Task(str(place), str(place / "lake"), scratch=str(place / "file"))
    found = task_module.run_task(task)
    assert (found.reason, found.stage) == ("no_scratch", "making scratch space")


def test_a_run_is_removed_once(place: Path) -> None:
    ingest(record("a", "first"), record("b", "second"))
    given = ["fleet", "remove", "first", "first", "--lake", "lake"]
    result = CliRunner().invoke(app, given)
    assert result.exit_code == 0
    assert "1 run and 0 files of 0.0 MB removed" in result.stderr
    assert runs() == {"second": "b"}
    with pytest.raises(UsageError, match=r"(?s)no such run — first.*--lake .*lake"):
        Lake.open("lake").remove(["first"])


def test_shards_do_each_recording_once(place: Path) -> None:
    sources = [record(f"r{number}", f"run{number}") for number in range(20)]
    known = [normal_url(source) for source in sources]
    done = [[source for source in known if is_in_shard(source, n, 3)] for n in range(3)]
    assert sorted(itertools.chain(*done)) == sorted(known)
    assert all(done)
    totals = [fleet_ingest(sources, "lake", shard=(n, 3)).total for n in range(3)]
    assert totals == [len(each) for each in done]
    assert len(runs()) == 20
    # A source is of the same shard whatever stands beside it.
    (source,) = known[7:8]
    mine = next(n for n in range(3) if source in done[n])
    assert fleet_ingest([source], "lake", shard=(mine, 3)).total == 1
    assert fleet_ingest([source], "lake", shard=((mine + 1) % 3, 3)).total == 0
    given = ["fleet", "ingest", source, "--lake", "lake", "--shard", f"{(mine + 1) % 3}/3"]
    nothing = CliRunner().invoke(app, given)
    assert nothing.exit_code == 0
    assert "0 recordings for lake, shard" in nothing.stderr
    for text in ("3/3", "1", "-1/3", "a/b", "0/0"):
        wrong = CliRunner().invoke(app, [*given[:-1], text])
        assert (wrong.exit_code, "--shard takes I/N" in wrong.stderr) == (2, True)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize("sources", [("a", "z"), ("z", "a")])
def test_a_recording_that_was_moved_stays_with_shards(
    place: Path, monkeypatch: pytest.MonkeyPatch, sources: tuple[str, str], order: tuple[int, int]
) -> None:
    monkeypatch.setattr(
        fleet_ingest_module, "is_in_shard", lambda source, n, _: source.endswith("az"[n])
    )
    ingest(record("z", "first"))
    record("a", "first")
    record("z", "second")
    rows = [f"{source},robot {source}" for source in sources]
    Path("night.csv").write_text("\n".join(["path,robot", *rows]))
    for shard in order:
        fleet_ingest(["night.csv"], "lake", options=Options(database=False), shard=(shard, 2))
        assert failures() == {}
    assert runs() == {"first": "a", "second": "z"}
    assert labels_of("first") == {"robot": "robot a"}
