"""Small recordings: objects of the model are created two at the same time."""

from __future__ import annotations

import dataclasses
import random
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import pytest
from ingested import contents

from msgflow.db import objects
from msgflow.db.diagnostic import STAGED
from msgflow.errors import DatabaseError
from msgflow.ingest import calls, ingest, model, side_by_side
from msgflow.sim import Recording, simulate

_LONGEST_S = 20


def of_ingest(trace: Path, database: Path) -> dict[str, object]:
    ingest([trace], database)
    found = contents(database)
    found.pop("run")  # the moment of the ingest
    return dict(found)


@pytest.fixture(scope="module")
def lossy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trace with calls that are taken apart, since events before them were lost."""
    return simulate(
        "pipeline",
        tmp_path_factory.mktemp("trace") / "trace",
        factor=0.3,
        recording=Recording(lost_event_share=0.2),
    ).directory


@pytest.mark.parametrize("worker_count", [1, 2, 5])
def test_each_step_runs_once_and_after_those_that_it_needs(worker_count: int) -> None:
    chosen = random.Random(worker_count)
    needs = [set(chosen.sample(range(step), min(step, 3))) for step in range(200)]
    began: list[int] = []
    done: set[int] = set()

    def work(step: int) -> None:
        began.append(step)
        assert needs[step] <= done
        done.add(step)

    side_by_side.run(needs, [work] * worker_count)
    assert sorted(began) == list(range(200))


def test_steps_run_at_the_same_time() -> None:
    both = threading.Barrier(2)
    by: dict[str, int] = {}

    def working(name: str) -> Callable[[int], None]:
        def work(step: int) -> None:
            by[name] = step
            both.wait(_LONGEST_S)

        return work

    side_by_side.run([set(), set()], [working("a"), working("b")])
    assert sorted(by.values()) == [0, 1]


def test_the_longest_row_comes_first() -> None:
    began: list[int] = []
    # 1, then 2, then 4 wait for each other; 0 for none, and only 3 for it.
    side_by_side.run([set(), set(), {1}, {0}, {2}], [began.append])
    assert began == [1, 0, 2, 3, 4]


def test_nothing_begins_after_a_failure_and_nothing_is_left_under_way() -> None:
    has_begun, has_failed = threading.Event(), threading.Event()
    under_way: list[int] = []
    ended: list[int] = []

    def fail(step: int) -> None:
        assert has_begun.wait(_LONGEST_S)
        has_failed.set()
        raise KeyError(step)

    def work(step: int) -> None:
        under_way.append(step)
        has_begun.set()
        assert has_failed.wait(_LONGEST_S)
        time.sleep(0.01)  # by then the failure is known, sooner or later
        ended.append(under_way.pop())

    with pytest.raises(KeyError):
        side_by_side.run([()] * 500, [fail, work])
    assert 1 <= len(ended) < 400
    assert not under_way
    side_by_side.run([], [fail])


def test_who_waits_is_told_when_others_are_done() -> None:
    """More than one may wait for the same step."""
    done: list[int] = []

    def work(step: int) -> None:
        time.sleep(0.02)
        done.append(step)

    side_by_side.run([set(), {0}, {1}, {0, 2}], [work] * 5)
    assert done == [0, 1, 2, 3]


def test_ctrl_c_in_a_step_is_raised_too() -> None:
    """It would be lost in a thread, and who waits for the step would wait forever."""

    def fail(step: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        side_by_side.run([set(), {0}, {0}], [fail, fail])


def test_the_first_failure_is_raised() -> None:
    has_failed, has_begun = threading.Event(), threading.Event()

    def first(step: int) -> None:
        assert has_begun.wait(_LONGEST_S)
        has_failed.set()
        raise KeyError

    def second(step: int) -> None:
        has_begun.set()
        assert has_failed.wait(_LONGEST_S)
        time.sleep(0.05)
        raise ValueError

    with pytest.raises(KeyError):
        side_by_side.run([set(), set()], [first, second])


@pytest.mark.parametrize("needs", [[{0}], [{1}, set()], [set(), {0}, {1, 2}]])
def test_a_step_that_could_never_begin(needs: list[set[int]]) -> None:
    with pytest.raises(ValueError, match="needs itself or a later one"):
        side_by_side.run(needs, [lambda step: None])


def test_what_changes_other_objects_is_done_alone(
    lossy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    under_way: list[str] = []
    beside: dict[str, list[str]] = {}
    create, add = model.Growing.create, model.Growing.add

    def created(self: model.Growing, header: Any, con: duckdb.DuckDBPyConnection) -> None:
        under_way.append(header.name)
        create(self, header, con)
        under_way.remove(header.name)

    def added(self: model.Growing, header: Any) -> None:
        beside[header.name] = list(under_way)
        add(self, header)

    monkeypatch.setattr(model.Growing, "create", created)
    monkeypatch.setattr(model.Growing, "add", added)
    ingest([lossy], tmp_path / "new.duckdb")
    assert beside == {calls.TAKEN_APART: [], STAGED: []}


def test_an_object_waits_for_those_that_it_needs() -> None:
    headers = objects.load("model")
    needed = model._positions_needed(headers)
    names = {header.name for header in headers}
    for header, positions in zip(headers, needed, strict=True):
        found = {headers[position].name for position in positions}
        assert found == (names & set(header.needs)) - {header.name}


def test_the_same_comes_out_as_one_by_one(
    lossy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    by: dict[str, set[int]] = {"small": set(), "large": set()}
    size = "small"
    create = model.Growing.create

    def noted(self: model.Growing, header: Any, con: duckdb.DuckDBPyConnection) -> None:
        by[size].add(id(con))
        create(self, header, con)

    taken_apart: list[str] = []
    take_apart = calls.take_apart

    def counted(con: duckdb.DuckDBPyConnection, call: Any) -> None:
        taken_apart.append(size)
        take_apart(con, call)

    monkeypatch.setattr(calls, "take_apart", counted)
    monkeypatch.setattr(model.Growing, "create", noted)
    found = of_ingest(lossy, tmp_path / "small.duckdb")
    size = "large"
    monkeypatch.setattr(sys.modules[ingest.__module__], "_EVENTS_SIDE_BY_SIDE", 0)
    assert of_ingest(lossy, tmp_path / "large.duckdb") == found
    assert (len(by["small"]), len(by["large"])) == (2, 1)
    assert set(taken_apart) == {"small", "large"}


def test_with_too_little_memory_the_rest_is_created_one_by_one(
    lossy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = of_ingest(lossy, tmp_path / "expected.duckdb")
    create = model.Growing.create
    short: list[str] = []

    def at_first_short(self: model.Growing, header: Any, con: duckdb.DuckDBPyConnection) -> None:
        if header.name == "staging.callback_binding" and not short:
            short.append(header.name)
            raise duckdb.OutOfMemoryException("of two at once")
        create(self, header, con)

    monkeypatch.setattr(model.Growing, "create", at_first_short)
    assert of_ingest(lossy, tmp_path / "short.duckdb") == expected
    assert short


@pytest.mark.parametrize("where", ["in a step", "while calls are taken apart"])
def test_a_full_disk_is_said_at_once(
    where: str, lossy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = "failed to offload data block (max_temp_directory_size)"
    create = model.Growing.create

    def filled(*args: Any) -> None:
        raise duckdb.OutOfMemoryException(full)

    def filling(self: model.Growing, header: Any, con: duckdb.DuckDBPyConnection) -> None:
        if header.name == "staging.callback_binding":
            filled()
        create(self, header, con)

    if where == "in a step":
        monkeypatch.setattr(model.Growing, "create", filling)
    else:
        monkeypatch.setattr(calls, "take_apart", filled)
    with pytest.raises(DatabaseError, match="no space left"):
        ingest([lossy], tmp_path / "new.duckdb")


def test_as_much_is_dropped(lossy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module: Any = sys.modules[ingest.__module__]
    load, build = module.load_traces, model.build
    events = 0
    tables: list[set[tuple[str, str]]] = []

    def loaded(con: duckdb.DuckDBPyConnection, *args: Any, **options: Any) -> Any:
        return dataclasses.replace(
            load(con, *args, **options), event_counts={(0, "ros2:rcl_init"): events}
        )

    def noted(con: duckdb.DuckDBPyConnection, *args: Any, **options: Any) -> None:
        build(con, *args, **options)
        tables.append(
            set(
                con.execute(
                    "SELECT database_name, table_name FROM duckdb_tables() "
                    "WHERE database_name IN ('raw', 'staging')"
                ).fetchall()
            )
        )

    monkeypatch.setattr(module, "load_traces", loaded)
    monkeypatch.setattr(model, "build", noted)
    for events in (1_000_000, 40_000_000):
        ingest([lossy], tmp_path / f"{events}.duckdb")
    small, large = tables
    assert small == large


@pytest.mark.parametrize(("events", "is_small"), [(1_999_999, True), (2_000_000, False)])
def test_only_small_recordings_are(
    events: int, is_small: bool, lossy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module: Any = sys.modules[ingest.__module__]
    load, build = module.load_traces, model.build
    asked: list[bool] = []

    def loaded(*args: Any, **options: Any) -> Any:
        return dataclasses.replace(
            load(*args, **options), event_counts={(0, "ros2:rcl_init"): events}
        )

    def noted(*args: Any, **options: Any) -> None:
        asked.append(options["is_small"])
        build(*args, **options)

    monkeypatch.setattr(module, "load_traces", loaded)
    monkeypatch.setattr(model, "build", noted)
    ingest([lossy], tmp_path / "new.duckdb")
    assert asked == [is_small]
