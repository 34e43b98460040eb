"""`msgflow verify` and `msgflow targets`."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import duckdb
import pytest
from support.thorough import few, thorough
from typer.testing import Result

Msgflow = Callable[..., Result]


@pytest.fixture
def demo(msgflow: Msgflow, simulated: Callable[..., Path]) -> Msgflow:
    """Asks a database with three seconds of a robot."""
    shutil.copy(simulated("demo", 0.3), "msgflow.duckdb")
    return msgflow


@pytest.mark.thorough
def test_from_a_suggestion_to_verdicts(demo: Msgflow, tmp_path: Path) -> None:
    file = tmp_path / "targets.yaml"
    assert demo("suggest", "targets", "--run", "trace", "-o", file).exit_code == 0
    result = demo("verify", file, "--run", "trace", "--format", "json")
    assert result.exit_code == 0
    assert result.stderr.splitlines()[0] == "run: trace (1)"
    assert result.stderr.splitlines()[-1].endswith(" passed, 0 failed, 0 not measured, 0 no data")
    assert {row["verdict"] for row in json.loads(result.stdout)} == {"passed"}


@pytest.mark.parametrize(
    ("requirement", "code", "allowed"),
    [
        ("rate: < 1000 Hz", 0, 0),
        ("rate: < 1 Hz", 1, 1),
        ("node: /planner\n    latency: p99 < 1 s", 5, 0),
        thorough("rate: fast", 2, 2),
    ],
)
def test_exit_codes(
    demo: Msgflow, tmp_path: Path, requirement: str, code: int, allowed: int
) -> None:
    topics = demo("query", "topics", "--measure", "rate", "--format", "jsonl").stdout.splitlines()
    publisher = json.loads(topics[0])
    file = tmp_path / "targets.yaml"
    requirement = requirement.replace("/planner", publisher["publisher"])
    file.write_text(f"targets:\n  - topic: {publisher['topic_name']}\n    {requirement}\n")
    result = demo("verify", file)
    assert result.exit_code == code
    assert ("passed" in result.stdout) == (code == 0)
    assert demo("verify", file, "--allow-not-measured").exit_code == allowed


def test_a_value_that_has_its_unit_has_no_column_of_it(
    demo: Msgflow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    topic = json.loads(demo("query", "topics", "--format", "jsonl").stdout.splitlines()[0])
    file = tmp_path / "targets.yaml"
    file.write_text(f"targets:\n  - topic: {topic['topic_name']}\n    rate: < 1000 Hz\n")
    monkeypatch.setenv("COLUMNS", "100")
    shown = demo("verify", file).stdout
    assert " Hz" in shown
    assert "unit" not in shown.splitlines()[0].split()


def test_a_file_that_ends_with_xml_is_junit(demo: Msgflow, tmp_path: Path) -> None:
    file, output = tmp_path / "targets.yaml", tmp_path / "verdicts.xml"
    file.write_text('targets:\n  - process: "*"\n    utilisation: < 0 %\n')
    result = demo("verify", file, "-o", output)
    assert result.exit_code == 1
    assert ElementTree.parse(output).getroot().tag == "testsuites"
    assert result.stdout == ""


@pytest.mark.parametrize(
    "name", few(["verdicts.xml", "verdicts.json", "verdicts.csv"], "verdicts.csv")
)
def test_with_a_file_it_says_what_failed(demo: Msgflow, tmp_path: Path, name: str) -> None:
    file = tmp_path / "targets.yaml"
    file.write_text(
        "targets:\n  - topic: /imu/data\n    rate: 1 Hz ± 5 %\n"
        "  - topic: /lidar/points\n    rate: 10 Hz ± 5 %\n"
    )
    result = demo("verify", file, "-o", tmp_path / name)
    assert result.exit_code == 1
    *_, failed, summary = result.stderr.splitlines()
    assert failed.startswith("failed: /imu/driver → /imu/data: rate 1 Hz ± 5 %: ")
    assert failed.endswith(" Hz")
    assert summary == "1 passed, 1 failed, 0 not measured, 0 no data"


def test_a_narrow_table_leaves_no_requirement_without_a_name(
    demo: Msgflow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    file = tmp_path / "targets.yaml"
    file.write_text(
        "targets:\n  - topic: /imu/data\n    rate: 1 Hz ± 5 %\n"
        "  - topic: /gone\n    rate: 10 Hz ± 5 %\n"
    )
    result = demo("verify", file)
    assert result.exit_code == 1
    said = " ".join(result.stderr.split())
    assert "not measured: /gone: rate 10 Hz ± 5 %: the run has no such topic — /gone" in said
    # The table names what failed.
    assert "failed: " not in said
    assert "failed" in result.stdout


def test_several_runs_are_refused(demo: Msgflow, tmp_path: Path) -> None:
    with duckdb.connect("msgflow.duckdb") as connection:
        connection.execute(
            "INSERT INTO store.run SELECT * REPLACE (2 AS run_id, 'other' AS name) FROM store.run"
        )
    file = tmp_path / "targets.yaml"
    file.write_text('targets:\n  - process: "*"\n    utilisation: < 100 %\n')
    result = demo("verify", file, "--run", "all")
    assert result.exit_code == 2
    assert "a verification is of one run" in result.stderr


@pytest.mark.thorough
def test_an_empty_suggestion_leads_to_nothing(
    msgflow: Msgflow, small_database: Path, tmp_path: Path
) -> None:
    result = msgflow("suggest", "targets", "-o", tmp_path / "t.yaml", "--db", small_database)
    assert result.exit_code == 0
    assert "nothing was measured often enough" in result.stderr
    assert "next:" not in result.stderr
