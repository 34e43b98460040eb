"""What `why` says first of a robot with problems that are planted in it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import pytest
from robot.judge import Culprit, Told, faults, missed, told
from robot.problems import ROBOT
from robot.simulated import robot
from support.thorough import thorough

from msgflow import Database
from msgflow.ingest import ingest
from msgflow.query.why import Explanation
from msgflow_sim import simulate
from msgflow_sim.entity import SECOND


def explained(
    directory: Path, problems: Collection[str], seconds: int, *, with_kernel: bool = True
) -> Explanation:
    """Record the robot, and ask."""
    simulate(replace(robot(problems), duration_ns=seconds * SECOND), directory)
    database = directory / "run.duckdb"
    ingest([directory / "robot" if with_kernel else directory / "robot" / "ust"], database)
    with Database(database) as opened:
        return opened.why()


def lenient(culprit: Culprit) -> Culprit:
    """The hog makes others longer."""
    limits = tuple(replace(each, most=2 * each.most) for each in culprit.limits)
    return replace(culprit, limits=limits)


@pytest.mark.parametrize("with_kernel", [True, thorough(False)])
def test_it_names_each_of_seven_problems_at_once(tmp_path: Path, with_kernel: bool) -> None:
    why = explained(tmp_path, ROBOT, 7, with_kernel=with_kernel)
    rows: list[Told] = told(why.verdict.table.to_pylist())
    for name, culprit in ROBOT.items():
        each = [list(faults(lenient(culprit), row, knows_cpu=with_kernel)) for row in rows]
        assert [] in each, (name, each, rows)
    verdict = why.verdict.table.to_pylist()
    harm = [row["harm_ns"] for row in verdict if row["kind"] != "late_start"]
    assert harm == sorted(harm, reverse=True)
    # The first sentence leads to the tables below it.
    assert why.paths.table["path"][0].as_py() == verdict[0]["path"]
    pieces = why.slow_flow.table.to_pylist()
    assert pieces[-1]["activity"] == "rest"
    assert sum(piece["duration_ns"] for piece in pieces) == pieces[0]["latency_ns"]
    is_said = any("msgflow record shows which callbacks compute" in note for note in why.notes)
    assert is_said is not with_kernel


def test_nothing_stands_out_where_nothing_was_planted(tmp_path: Path) -> None:
    why = explained(tmp_path, (), 3)
    verdict = why.verdict.table.to_pylist()
    assert list(missed((), told(verdict), knows_cpu=True)) == []
    assert len(verdict) == 1
    assert not len(why.losses)
