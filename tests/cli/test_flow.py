from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from msgflow import Database
from msgflow.query.flow import MOST_VERTICES
from msgflow.text.values import format_duration

Msgflow = Callable[..., Result]


def test_the_tree_goes_to_stdout_and_words_to_stderr(
    msgflow: Msgflow, small_database: Path
) -> None:
    result = msgflow("flow", "/chatter", "--at", "0.1s", "--db", small_database)
    assert result.exit_code == 0
    with Database(small_database) as database:
        assert result.stdout == f"{database.flow('/chatter', at='0.1s')}\n"
    assert result.stdout.splitlines()[1:] == [
        "+0 ns  /talker  publishes /chatter  in 100 ns or more  thread thread 1  ◀"
    ]
    assert result.stderr == "run: noon (2)\n"


@pytest.mark.thorough
def test_every_start_and_direction(msgflow: Msgflow, small_database: Path) -> None:
    for direction in ("forward", "backward", "both"):
        arguments = ("flow", "--publication", 1, "--direction", direction, "--absolute")
        result = msgflow(*arguments, "--db", small_database)
        assert result.exit_code == 0
        assert "2023-11-14T22:13:20.500000000Z" in result.stdout
    for kind in ("take", "callback-instance"):
        result = msgflow("flow", f"--{kind}", 7, "--db", small_database)
        assert result.exit_code == 2
        assert f"no such {kind.replace('-', '_')} — 7" in result.stderr


def test_json_and_files(msgflow: Msgflow, small_database: Path, tmp_path: Path) -> None:
    start = ("flow", "--publication", "2", "--db", small_database)
    content = json.loads(msgflow(*start, "--format", "json").stdout)
    assert [node["topic_name"] for node in content["nodes"]] == ["/chatter"]
    result = msgflow(*start, "-o", tmp_path / "flow.json")
    assert result.stdout == ""
    assert json.loads((tmp_path / "flow.json").read_text()) == content
    msgflow(*start, "-o", tmp_path / "flow.txt")
    assert (tmp_path / "flow.txt").read_text() == msgflow(*start).stdout


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "a flow starts from one thing"),
        (("/chater",), "no such topic or node"),
        (("/chatter", "--at", "2s"), "at or after that time — 2s"),
        (("--publication", "1", "--limit", "0"), "--limit"),
        (("--publication", "1", "--direction", "up"), "--direction"),
        (("--publication", "1", "-o", "a.xlsx"), "no format has this suffix — a.xlsx"),
        (("--publication", "1", "-o", "a.csv"), ".txt, .json, .html, .htm"),
        (("/chatter", "--why", "-o", "a.html"), "no page"),
        (("--publication", "1", "--slowest", "1"), "publication_id"),
        (("--publication", "1", "--to", "/chatter"), "--to"),
        (("--slowest", "2", "--format", "json"), "--slowest 2"),
        (("--slowest", "1"), "no flow arrived"),
        (("/chatter", "--why", "--depth", "3"), "--why goes without --depth"),
        (("/chatter", "--why"), "no subscription took this message"),
        (("/chatter", "--wide"), "a flow is a tree"),
        (("--slowest", "2", "--why"), "critical-path --slowest 2"),
        (("--case", "last"), "choose among flows"),
        (("--slowest", "1", "--to", "/nothing"), "/nothing"),
    ],
)
def test_mistakes_have_code_2(
    msgflow: Msgflow, small_database: Path, options: tuple[str, ...], message: str
) -> None:
    result = msgflow("flow", *options, "--db", small_database)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert message in result.stderr
    assert "\n\nhint: " in result.stderr


@pytest.mark.thorough
def test_the_slowest_flows_are_those_of_the_query(
    msgflow: Msgflow, simulated: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    demo = simulated("demo", 0.1)
    monkeypatch.setenv("MSGFLOW_DB", str(demo))
    with Database(demo) as database:
        rows = database.query("flows", to="/control/cmd", slowest=2).to_arrow()
        takes = rows["take_id"].to_pylist()
        latency = rows["latency_ns"].to_pylist()[1]
        trees = [str(database.flow(take_id=take, direction="backward")) for take in takes]
    result = msgflow("flow", "--slowest", 2, "--to", "/control/cmd")
    assert result.exit_code == 0
    assert result.stdout == "\n\n".join(trees) + "\n"
    assert result.stdout.startswith(f"take {takes[0]}, /control/cmd")
    assert (
        f"note: slowest flow 2: {format_duration(latency)} to take {takes[1]}, /" in result.stderr
    )
    every = msgflow("flow", "--slowest", 1, "--to", "/control/cmd", "--case", "every_pair")
    assert "note: slowest flow 1: " in every.stderr
    forward = msgflow("flow", "--slowest", 1, "--to", "/control/cmd", "--direction", "forward")
    assert forward.stdout.splitlines()[1:] != result.stdout.splitlines()[1:]


def test_an_identity_may_have_its_run(msgflow: Msgflow, small_database: Path) -> None:
    words = ("flow", "--publication", 1, "--db", small_database)
    plain = msgflow(*words)
    of_run = {run: msgflow(*words, "--run", run) for run in ("morning", "noon")}
    assert sorted(result.exit_code for result in of_run.values()) == [0, 2]
    for result in of_run.values():
        if result.exit_code:
            assert "publication 1 is not of run " in result.stderr
        else:
            assert result.stdout == plain.stdout


def test_a_page_is_written_in_place_of_the_tree(
    msgflow: Msgflow, small_database: Path, tmp_path: Path
) -> None:
    target = tmp_path / "flow.html"
    result = msgflow("flow", "--publication", 1, "-o", target, "--db", small_database)
    assert (result.exit_code, result.stdout) == (0, "")
    assert f"{target.stat().st_size:,} bytes written to {target}" in result.stderr


def test_an_option_that_cannot_be_names_what_can(msgflow: Msgflow, small_database: Path) -> None:
    for option, value, error in (
        ("--direction", "up", "--direction has no such value — up"),
        ("--depth", "-1", "--depth is at least 0 — -1"),
        ("--limit", "many", "--limit takes a whole number — many"),
        ("--limit", MOST_VERTICES + 1, f"--limit is at most {MOST_VERTICES}"),
    ):
        result = msgflow("flow", "--publication", 1, option, value, "--db", small_database)
        assert result.exit_code == 2
        assert f"error: {error}" in result.stderr


@pytest.mark.thorough
def test_why_is_the_critical_path_of_the_flow(
    msgflow: Msgflow, simulated: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    demo = simulated("demo", 0.1)
    monkeypatch.setenv("MSGFLOW_DB", str(demo))
    with Database(demo) as database:
        expected = database.query("critical-path", to="/control/cmd").table
        take = expected["take_id"][0].as_py()
        ((publication,),) = (
            database.sql(f"SELECT publication_id FROM link_transport WHERE take_id = {take}")
            .table.to_pandas()
            .to_numpy()
            .tolist()
        )
        by_message = database.flow_why(publication_id=publication).table
        instance = (
            database.sql(
                f"SELECT callback_instance_id FROM callback_instance WHERE take_id = {take}"
            )
            .table["callback_instance_id"][0]
            .as_py()
        )
        by_instance = database.flow_why(callback_instance_id=instance).table
    why = ("flow", "--slowest", 1, "--to", "/control/cmd", "--why")
    narrow, wide = (msgflow(*why, *more) for more in ((), ("--wide",)))
    assert "publication_id" in wide.stdout
    assert "publication_id" not in narrow.stdout
    rows = msgflow(*why, "--format", "json")
    assert rows.exit_code == 0
    assert [row["duration_ns"] for row in json.loads(rows.stdout)] == (
        expected["duration_ns"].to_pylist()
    )
    assert by_message["take_id"][0].as_py() == take
    assert sum(by_instance["duration_ns"].to_pylist()) == by_instance["latency_ns"][0].as_py()


@pytest.mark.thorough
def test_a_node_means_what_it_did_first(msgflow: Msgflow, simulated: Callable[..., Path]) -> None:
    demo = simulated("demo", 0.1)
    with Database(demo) as database:
        first, later = (
            database.flow("/planning/planner"),
            database.flow("/planning/planner", at="0.5s"),
        )
        nodes = [flow.nodes[flow.start_key] for flow in (first, later)]
        image = database.flow("/camera/image", at="0.5s")
    assert {node["node"] for node in nodes} == {"/planning/planner"}
    assert nodes[0]["start_ns"] < nodes[1]["start_ns"]
    assert nodes[1]["start_ns"] >= image.run.start_ns + 500_000_000
