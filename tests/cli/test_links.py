"""`msgflow links` and `msgflow ingest --links`."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from support.golden import fill_case
from support.ingested import made_once
from typer.testing import Result

from msgflow.db.derivation import derive
from msgflow.errors import UsageError
from msgflow_sim import Recording, simulate

Msgflow = Callable[..., Result]


@pytest.mark.thorough
def test_from_a_suggestion_to_links(msgflow: Msgflow, shared_traces: Path, tmp_path: Path) -> None:
    assert msgflow("ingest", shared_traces / "sync_1_1").exit_code == 0
    result = msgflow("suggest", "links")
    assert result.exit_code == 0
    assert result.stdout.splitlines()[-1] == "links: []"
    assert result.stderr == "run: sync_1_1 (1)\n"
    file = tmp_path / "links.yaml"
    file.write_text(
        "links: [{kind: periodic_async, node: /sync_one_to_one, inputs: '*', outputs: '*'}]"
    )
    result = msgflow("links", "apply", file)
    assert result.exit_code == 0
    assert result.stdout == ""
    assert "1 link declared: 0 indirect links between messages" in result.stderr
    assert (
        "note: no message took the link from /topic_a to /topic_b (periodic_async): callbacks of"
        " /topic_a publish all of it" in " ".join(result.stderr.split())
    )
    listed = msgflow("links", "--format", "csv")
    (row,) = csv.DictReader(listed.stdout.splitlines())
    assert (row["kind"], row["source"], row["inputs"]) == ("periodic_async", "file", "/topic_a")
    file.write_text(file.read_text().replace("sync_one_to_one", "sync"))
    result = msgflow("links", "apply", file, "--run", 1)
    assert result.exit_code == 2
    assert f"{file}, line 1: no such node — /sync" in result.stderr
    assert msgflow("links", "--format", "csv").stdout == listed.stdout
    result = msgflow("ingest", shared_traces / "pingpong", "--links", file)
    assert result.exit_code == 2
    assert "no such node" in result.stderr
    assert "pingpong" not in msgflow("info", "--section", "runs").stdout


def test_without_runs_or_files(msgflow: Msgflow, fresh_database: Path, tmp_path: Path) -> None:
    file = tmp_path / "links.yaml"
    result = msgflow("links", "apply", file, "--db", fresh_database)
    assert result.exit_code == 2
    assert "cannot read the file" in result.stderr
    file.write_text("links: []")
    result = msgflow("links", "apply", file, "--db", fresh_database)
    assert result.exit_code == 2
    assert "the database holds no run" in result.stderr
    assert msgflow("links", "apply", file, "--db", tmp_path / "none.duckdb").exit_code == 4


def test_what_is_doubtful_of_suggestions_is_said(msgflow: Msgflow, fresh_database: Path) -> None:
    case = "several_candidates_of_one_node"
    cases = Path(__file__).parents[1] / "query" / "cases" / "links-suggested"
    with duckdb.connect(str(fresh_database)) as con:
        fill_case(con, cases / f"{case}.case")
        derive(con, 1)
    result = msgflow("suggest", "links", "--db", fresh_database)
    assert result.exit_code == 0
    assert "2 of 2 candidates are doubtful, see the comments: /merge\n" in result.stderr
    text = result.stdout.replace("\n  # ", " ")
    assert text.count("Doubtful: ") == text.count("which of its outputs use the messages") == 2


@pytest.fixture
def undeclared(msgflow: Msgflow, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database of a system whose indirect links are not declared, to change it."""

    def make(path: Path) -> None:
        trace = simulate("periodic_async", path.parent / "trace", factor=0.1).directory
        result = msgflow("ingest", trace, "--ignore", "ros2:message_link_*", "--db", path)
        assert result.exit_code == 0, result.stderr

    made = made_once(tmp_path_factory, "undeclared", make)
    return Path(shutil.copyfile(made, "msgflow.duckdb"))


@pytest.mark.thorough
@pytest.mark.usefixtures("undeclared")
def test_suggestions_are_written_and_applied_in_one_go(msgflow: Msgflow) -> None:
    Path("links.yaml").write_text("mine")
    result = msgflow("suggest", "links", "--apply")
    assert result.exit_code == 2
    assert "there is a file of this name — links.yaml" in result.stderr
    assert Path("links.yaml").read_text() == "mine"
    (Path("links.yaml")).unlink()
    result = msgflow("suggest", "links", "--apply")
    assert result.exit_code == 0
    assert result.stdout == ""
    assert "/periodic_1_to_1: /a → /periodic_1_to_1/0 (periodic_async)\n" in result.stderr
    assert "links declared: " in result.stderr
    assert result.stderr.endswith("written to links.yaml\n")
    text = Path("links.yaml").read_text()
    listed = msgflow("links", "--format", "csv").stdout
    assert '"/periodic_1_to_1","/a","/periodic_1_to_1/0"' in listed
    # What is declared stays in the file, and nothing is declared anew.
    again = msgflow("suggest", "links", "--apply", "-o", "again.yaml")
    assert again.exit_code == 0
    assert "no candidate is without a doubt: nothing is declared\n" in again.stderr
    assert msgflow("links", "--format", "csv").stdout == listed
    assert msgflow("links", "apply", "again.yaml").exit_code == 0
    # All but the identity, the last column.
    anew = msgflow("links", "--format", "csv").stdout
    assert [line.rpartition(",")[0] for line in anew.splitlines()] == [
        line.rpartition(",")[0] for line in listed.splitlines()
    ]
    assert text.count("- kind:") == Path("again.yaml").read_text().count("- kind:")


@pytest.mark.thorough
def test_topics_without_a_name_are_named(msgflow: Msgflow, tmp_path: Path) -> None:
    late = Recording(start_ns=300_000_000)
    trace = simulate("pipeline", tmp_path / "trace", factor=0.1, recording=late).directory
    ingested = msgflow("ingest", trace)
    assert "topic_unnamed" in ingested.stderr
    (offered, *_) = [
        line for line in msgflow("suggest", "links").stdout.splitlines() if "/NAME" in line
    ]
    file = tmp_path / "links.yaml"
    file.write_text(f"topics:\n{offered.replace('# ', '').replace('/NAME', '/scan')}")
    applied = msgflow("links", "apply", file)
    assert applied.exit_code == 0, applied.stderr
    assert "1 topic named\n" in applied.stderr
    answer = msgflow("query", "e2e-latency", "--from", "/scan")
    assert answer.exit_code == 0, answer.stderr
    assert "/scan" in answer.stdout


@pytest.mark.usefixtures("undeclared")
def test_a_file_that_cannot_be_applied_is_not_written(
    msgflow: Msgflow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise UsageError("does not fit")

    monkeypatch.setattr("msgflow.links.annotations.match_links", refuse)
    file = tmp_path / "new.yaml"
    result = msgflow("suggest", "links", "--apply", "-o", file)
    assert result.exit_code == 2
    assert "does not fit" in result.stderr
    assert not file.exists()


def test_suggestions_are_for_one_run(msgflow: Msgflow, fresh_database: Path) -> None:
    result = msgflow("suggest", "links", "--run", "all", "--db", fresh_database)
    assert result.exit_code == 2
    assert "a file for one run" in result.stderr
    assert result.stdout == ""
