"""From a trace to an answer, as a user does it."""

from __future__ import annotations

import json
import tarfile
from collections.abc import Callable
from pathlib import Path

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace
from typer.testing import Result

from msgflow.ingest import IngestReport
from msgflow_sim import simulate

Msgflow = Callable[..., Result]


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short trace of a pipeline."""
    return simulate("pipeline", tmp_path_factory.mktemp("trace") / "robot", factor=0.1).directory


@pytest.mark.thorough
def test_two_commands_lead_to_the_answer_and_a_trace_is_ingested_once(
    msgflow: Msgflow, trace: Path
) -> None:
    ingested = msgflow("ingest", trace)
    assert ingested.exit_code == 0, ingested.stderr
    assert ingested.stdout == ""
    assert "read into msgflow.duckdb as run robot (1)" in ingested.stderr
    assert "next: msgflow why\n" in ingested.stderr
    answer = msgflow("why")
    assert answer.exit_code == 0, answer.stderr
    assert "/topic_a" in answer.stdout
    assert "run: robot (1)" in answer.stderr
    again = msgflow("ingest", trace)
    assert again.exit_code == 2
    assert "--replace" in again.stderr
    # It says nothing where nothing is to be said.
    replaced = msgflow("ingest", trace, "--replace", "--quiet", "--name", "first")
    assert (replaced.exit_code, replaced.stdout, replaced.stderr) == (0, "", "")
    runs = json.loads(
        msgflow("info", "--section", "runs", "--run", "all", "--format", "json").stdout
    )
    assert [run["name"] for run in runs] == ["first"]
    assert "first" in msgflow("info").stdout


@pytest.mark.thorough
def test_an_archive_beside_the_traces_is_named_and_read_as_the_note_says(
    msgflow: Msgflow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = simulate("pipeline", tmp_path / "robot", factor=0.03).directory / "alpha"
    events = {"sched_switch": {"prev_tid": "i32"}}
    packet = Packet([Event(1, "sched_switch", (7,))])
    write_trace(
        tmp_path / "kernel",
        TraceContent(events, {0: [packet]}, environment={"hostname": "robot", "domain": "kernel"}),
    )
    archive = session / "kernel.tar.xz"
    with tarfile.open(archive, "w:xz") as file:
        file.add(tmp_path / "kernel", "kernel")
    database = tmp_path / "x.duckdb"
    note = msgflow("ingest", session, "--db", database).stderr.splitlines()[-2]
    command = f"msgflow ingest {session} {archive} --replace --db {database}"
    assert note == (
        "note: 1 archive beside the traces was not read; to read what is of the same recording: "
        + command
    )
    again = msgflow(*command.split()[1:])
    assert again.exit_code == 0, again.stderr
    query = ("SELECT domain FROM trace ORDER BY 1", "--format", "csv", "--db", database)
    assert msgflow("sql", *query).stdout.split() == ['"domain"', '"kernel"', '"ust"']
    assert "archive beside" not in again.stderr
    # Its times are others, but it lies in the folder of the session.
    assert "recordings" not in again.stderr
    report = IngestReport(1, "robot", (), 9, {"reading": 1.0})
    monkeypatch.setattr("msgflow.ingest.ingest", lambda *_, **__: report)
    assert "archive" in msgflow("ingest", session).stderr
    assert "archive" not in msgflow("ingest", session, "--quiet").stderr


@pytest.mark.parametrize("option", ["-o", "--output"])
def test_the_option_of_other_commands_for_a_file_names_that_for_the_database(
    msgflow: Msgflow, option: str
) -> None:
    refused = msgflow("ingest", "trace", option, "robot.duckdb")
    assert refused.exit_code == 2
    assert f"error: no such option: {option}\n" in refused.stderr
    assert "hint: --db FILE names the database\n" in refused.stderr
    # Other mistakes are explained as anywhere else.
    assert "ingest --help" in msgflow("ingest", "trace", "--outline").stderr
    assert "fleet ingest --help" in msgflow("fleet", "ingest", "trace", option, "lake").stderr


@pytest.mark.thorough
def test_events_of_ones_own_are_loaded_on_request(msgflow: Msgflow, tmp_path: Path) -> None:
    trace = simulate("own_events", tmp_path / "robot", factor=0.03).directory
    mistyped = msgflow("ingest", trace, "--events", "my_pgk:*")
    assert mistyped.exit_code == 0, mistyped.stderr
    said = " ".join(mistyped.stderr.split())
    assert "user_event_not_loaded (1): the input" in said
    assert "patterns that load no event: my_pgk:*; the traces have" in said
    assert " my_pkg:frame_done (" in said
    found = msgflow("ingest", trace, "--replace", "--events", "my_pkg:*", "--events", "*:frame*")
    assert found.exit_code == 0, found.stderr
    assert "user_event" not in found.stderr
    rows = msgflow("sql", "SELECT name, fields->>'$.label' AS label FROM user_event LIMIT 1")
    assert "my_pkg:frame_done  frame 0" in rows.stdout
    flow = msgflow("flow", "/image", "--at", "50ms")
    assert "my_pkg:frame_done 2 times, first at +" in flow.stdout


def test_options_of_a_query_reach_it(
    msgflow: Msgflow, simulated: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MSGFLOW_DB", str(simulated("pipeline", 0.1)))
    arguments = ("query", "e2e-latency", "--format", "json")
    assert json.loads(msgflow(*arguments, "--from", "/topic_a").stdout)
    unknown = msgflow(*arguments, "--from", "/topic_z")
    assert (unknown.exit_code, unknown.stdout) == (2, "")
    assert "there is no such topic or node in the run — /topic_z" in unknown.stderr
    assert "/topic_a" in unknown.stderr.partition("hint: ")[2]
    for option in ("--max-depth", "--max-paths"):
        for least in ("0", "-1"):
            refused = msgflow(*arguments, option, least)
            assert refused.exit_code == 2
            assert f"is at least 1 — {least}" in refused.stderr
    whole, late = (
        json.loads(msgflow(*arguments, *options).stdout)[0]["roots"]
        for options in ((), ("--start", "0.5"))
    )
    assert late < whole
    refused = msgflow("query", "e2e-latency", "--case", "middle")
    assert refused.exit_code == 2
    assert refused.stderr.startswith("error: --case has no such value — middle\n\nhint: choose ")


@pytest.mark.parametrize("options", [(), ("--quiet",)])
def test_what_went_wrong_is_said_even_when_quiet(
    msgflow: Msgflow, trace: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...]
) -> None:
    report = IngestReport(1, "robot", (), 9, {"reading": 1.0}, ("the disk is full",))
    monkeypatch.setattr("msgflow.ingest.ingest", lambda *_, **__: report)
    result = msgflow("ingest", trace, *options)
    assert result.exit_code == 0
    assert result.stderr.count("note: the disk is full\n") == 1
