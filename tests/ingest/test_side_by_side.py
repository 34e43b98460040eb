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
    """A trace with something in most objects of the model, and with calls that are taken apart."""
    return simulate(
        "services",
        tmp_path_factory.mktemp("trace") / "trace",
        factor=0.02,
        recording=Recording(lost_event_share=0.02),
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


def test_what_changes_other_objects_is_done_alone() -> None:
    headers = objects.load("model")
    needed = model._positions_needed(headers)
    positions = {header.name: position for position, header in enumerate(headers)}
    for position, header in enumerate(headers):
        assert needed[position] >= {positions[name] for name in header.needs if name in positions}
        for name in (calls.TAKEN_APART, STAGED):
            alone = positions[name]
            assert position == alone or (
                alone in needed[position] if position > alone else position in needed[alone]
            )


def test_the_same_comes_out_as_one_by_one(
    lossy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    by: dict[str, set[int]] = {"small": set(), "large": set()}
    size = "small"
    create = model.Growing.create

    def noted(self: model.Growing, header: Any, con: duckdb.DuckDBPyConnection) -> None:
        by[size].add(id(con))
        create(self, header, con)

    monkeypatch.setattr(model.Growing, "create", noted)
    found = of_ingest(lossy, tmp_path / "small.duckdb")
    size = "large"
    monkeypatch.setattr(sys.modules[ingest.__module__], "_EVENTS_SIDE_BY_SIDE", 0)
    assert of_ingest(lossy, tmp_path / "large.duckdb") == found
    assert (len(by["small"]), len(by["large"])) == (2, 1)


def test_with_too_little_memory_the_rest_is_created_one_by_one(
    lossy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = of_ingest(lossy, tmp_path / "expected.duckdb")
    create = model.Growing.create
    short: list[str] = []
    after: set[int] = set()

    def at_first_short(self: model.Growing, header: Any, con: duckdb.DuckDBPyConnection) -> None:
        if header.name == "staging.callback_binding" and not short:
            short.append(header.name)
            raise duckdb.OutOfMemoryException("of two at once")
        create(self, header, con)
        if header.name == "staging.callback_binding":
            after.add(threading.get_ident())

    monkeypatch.setattr(model.Growing, "create", at_first_short)
    assert of_ingest(lossy, tmp_path / "short.duckdb") == expected
    assert short
    assert len(after) == 1


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
