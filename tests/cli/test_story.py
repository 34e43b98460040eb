"""What became of a goal: `msgflow why --goal`, `msgflow flow --goal`."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from rich.cells import cell_len
from typer.testing import Result

from msgflow import Database
from msgflow.errors import UsageError
from msgflow.mcp.server import _Tools

Msgflow = Callable[..., Result]


@pytest.fixture
def actions(simulated: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> Path:
    path = simulated("actions", 0.2)
    monkeypatch.setenv("COLUMNS", "80")
    return path


def test_a_story_has_the_times_of_the_goal(actions: Path, msgflow: Msgflow) -> None:
    with Database(actions) as database:
        (goal,) = database.sql(
            "SELECT * FROM goal WHERE latency_ns IS NOT NULL AND NOT is_overlapping"
            " ORDER BY latency_ns DESC LIMIT 1"
        ).table.to_pylist()
        story = database.story(goal["goal_id"])
        answer = _Tools(database).why(goal=str(goal["goal_id"]))
        with pytest.raises(UsageError, match="a place and times of its own — place, end"):
            _Tools(database).why("/x", end="1s", goal=str(goal["goal_id"]))
    steps = {row["step"]: row for row in story.steps.table.to_pylist()}
    assert steps["accepted"]["at_ns"] == goal["answered_ns"]
    assert steps["first feedback"]["at_ns"] == goal["first_feedback_ns"]
    assert steps["result taken"]["at_ns"] == goal["result_taken_ns"]
    stages = [row["took_ns"] or 0 for row in steps.values() if row["is_stage"]]
    assert sum(stages) == goal["latency_ns"]
    (verdict,) = story.verdict.table.to_pylist()
    assert verdict["headline"].startswith(f"{goal['action_name']} {goal['goal_id']}, from /")
    assert verdict["evidence"][0].startswith("longest: ")
    assert verdict["headline"] in answer

    def say(command: str, *more: str) -> Result:
        return msgflow(command, more[0], goal["goal_id"], *more[1:], "--db", actions)

    shown = say("why", "--goal")
    assert shown.exit_code == 0
    assert verdict["headline"].split(":")[0] in shown.stdout
    assert max(map(cell_len, shown.stdout.splitlines())) <= 80
    written = json.loads(say("why", "--goal", "--format", "json").stdout)
    assert list(written) == ["verdict", "steps"]
    assert say("flow", "--goal").stdout == say("flow", "--request").stdout


def test_digits_that_several_goals_begin_with_are_refused(actions: Path, msgflow: Msgflow) -> None:
    with Database(actions) as database:
        goals = [row["goal_id"] for row in database.sql("FROM goal").table.to_pylist()]
    digit = next(
        digit
        for digit in "23456789"
        if int(digit) not in goals and sum(str(goal).startswith(digit) for goal in goals) > 1
    )
    for words, message, hint in (
        (["why", "--goal", digit], "several goals begin like that", f"did you mean {digit}"),
        (["flow", "--goal", "/dock"], "there is no such goal — /dock", "(/dock at "),
        (["why", "--goal", goals[0], "--request", 1], "one goal or one request", "--goal ID"),
        (["why", "/x", "--goal", goals[0]], "a goal has a place and times of its own", "leave it"),
        (["flow", "--goal", goals[0], "--request", 1], "a flow starts from one thing", "give one"),
        (["flow", "--goal", goals[0], "--why"], "--why is about a message", "msgflow why --goal"),
    ):
        result = msgflow(*words, "--db", actions)
        assert result.exit_code == 2
        said = " ".join(result.stderr.split())
        assert message in said
        assert hint in said


def test_before_kilted_it_says_what_is_known(
    older: Callable[[str], Path], msgflow: Msgflow
) -> None:
    result = msgflow("why", "--goal", 1, "--db", older("humble"))
    assert result.exit_code == 2
    said = " ".join(result.stderr.split())
    assert "no goal is known — 1" in said
    assert "action servers published their status " in said
    assert "since Kilted" in said


@pytest.fixture
def older(tmp_path: Path) -> Callable[[str], Path]:
    from msgflow.ingest import ingest
    from msgflow_sim import simulate

    def database(layout: str) -> Path:
        simulate("actions", tmp_path / "trace", factor=0.1, layout=layout)
        ingest([tmp_path / "trace"], tmp_path / "older.duckdb")
        return tmp_path / "older.duckdb"

    return database


def test_a_call_of_a_service_has_a_story(simulated: Callable[..., Path], msgflow: Msgflow) -> None:
    path = simulated("services", 0.1)
    with Database(path) as database:
        rows = database.sql(
            "SELECT q.request_id, r.taken_ns - q.sent_ns AS took_ns FROM request AS q"
            " JOIN response AS r ON q.request_id = r.request_id"
            " WHERE q.callback_instance_id IS NOT NULL ORDER BY took_ns DESC LIMIT 1"
        ).table.to_pylist()
    result = msgflow("why", "--request", rows[0]["request_id"], "--db", path, "--format", "json")
    steps = json.loads(result.stdout)["steps"]
    stages = [row for row in steps if row["is_stage"]]
    # The clocks of the two hosts are apart: the order of the rows is that of the times.
    assert {row["step"] for row in stages} == {"sent", "taken", "begun", "answered", "answer taken"}
    assert sum(row["took_ns"] or 0 for row in stages) == rows[0]["took_ns"]
