"""`msgflow links` and `msgflow ingest --links`."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import duckdb
from golden import fill_case
from typer.testing import Result

from msgflow.db.derivation import derive

Msgflow = Callable[..., Result]


def test_from_a_suggestion_to_links(msgflow: Msgflow, shared_traces: Path, tmp_path: Path) -> None:
    assert msgflow("ingest", shared_traces / "sync_1_1").exit_code == 0
    result = msgflow("links", "suggest")
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
    listed = msgflow("links", "list", "--format", "csv")
    (row,) = csv.DictReader(listed.stdout.splitlines())
    assert (row["kind"], row["source"], row["inputs"]) == ("periodic_async", "file", "/topic_a")
    file.write_text(file.read_text().replace("sync_one_to_one", "sync"))
    result = msgflow("links", "apply", file, "--run", 1)
    assert result.exit_code == 2
    assert f"{file}, line 1: no such node — /sync" in result.stderr
    assert msgflow("links", "list", "--format", "csv").stdout == listed.stdout
    result = msgflow("ingest", shared_traces / "pingpong", "--links", file)
    assert result.exit_code == 2
    assert "no such node" in result.stderr
    assert "pingpong" not in msgflow("query", "info").stdout


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
    result = msgflow("links", "suggest", "--db", fresh_database)
    assert result.exit_code == 0
    assert "2 of 2 candidates are doubtful, see the comments: /merge\n" in result.stderr
    text = result.stdout.replace("\n  # ", " ")
    assert text.count("Doubtful: ") == text.count("the node has several candidates") == 2


def test_suggestions_are_for_one_run(msgflow: Msgflow, fresh_database: Path) -> None:
    result = msgflow("links", "suggest", "--run", "all", "--db", fresh_database)
    assert result.exit_code == 2
    assert "a file for one run" in result.stderr
    assert result.stdout == ""
