"""Links that may be other ones: each answer about flows counts them, and names node and cure."""

from __future__ import annotations

import shutil
from pathlib import Path

import duckdb
import pytest
from support.golden import fill_case
from support.thorough import few

import msgflow
from msgflow.db.finding import kinds_of, store_findings

CASE = Path(__file__).parent / "cases" / "e2e-latency" / "marked_links.case"
QUERIES = (
    "e2e-latency",
    "e2e-latency-age",
    "e2e-latency-reaction",
    "e2e-latency-response",
    "flows",
    "path-breakdown",
    "critical-path",
)
MESSAGE = "/filter: 1 message on /a may be of other publications"
CAUSE = "/filter: 1 of 3 messages that led to /b may be others"


@pytest.fixture(scope="module")
def database(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three flows: one passes a message of two publications, one a cause that is one of two."""
    path = tmp_path_factory.mktemp("doubts") / "msgflow.duckdb"
    shutil.copyfile(empty_database, path)
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, CASE)
        doubts = [each for each in kinds_of("recording") if "ambiguous" in each.name]
        store_findings(connection, 1, doubts)
    return path


@pytest.mark.parametrize(
    "name", few(QUERIES, "e2e-latency", "flows", "path-breakdown", "critical-path")
)
def test_each_query_of_flows_names_the_node_and_the_cure(database: Path, name: str) -> None:
    with msgflow.open_db(database) as db:
        notes = " ".join(db.query(name).notes)
    said = (MESSAGE, CAUSE, "one mutually exclusive callback group")
    assert [each for each in said if each not in notes] == []


def test_only_flows_that_are_shown_count(database: Path) -> None:
    with msgflow.open_db(database) as db:
        assert CAUSE not in " ".join(db.query("flows", where="root_id = 1").notes)
        assert CAUSE not in " ".join(db.query("e2e-latency", end="+1.5us").notes)


@pytest.mark.thorough
def test_why_and_compare_say_so(database: Path) -> None:
    with msgflow.open_db(database) as db:
        assert CAUSE in " ".join(db.why().notes)
        compared = db.compare(1, 1)
    assert f"run B, {compared.run_b.title}, {CAUSE}" in " ".join(compared.result.notes)


def test_a_requirement_does_not_pass_in_silence(database: Path, tmp_path: Path) -> None:
    targets = tmp_path / "targets.yaml"
    targets.write_text(
        "targets:\n"
        "  - path: [/a, /b]\n"
        "    latency: max < 1 s\n"
        "    completeness: '>= 99 %'\n"
        "  - topic: /b\n"
        "    latency: max < 1 s\n"
    )
    with msgflow.open_db(database) as db:
        verification = db.verify(targets)
    reasons = [
        (row["metric"], row["verdict"], row["reason"])
        for row in verification.result.to_arrow().to_pylist()
    ]
    doubt = "values by links that may be other ones: 2"
    assert sorted(reasons, key=str) == [
        ("completeness", "passed", doubt),
        ("latency", "passed", doubt),
        ("latency", "passed", None),
    ]
    assert CAUSE in " ".join(verification.result.notes)
    assert f"<system-out>{doubt}</system-out>" in verification.to_junit()


def test_flows_say_where_they_begin_if_their_publisher_is_not_traced(fresh_database: Path) -> None:
    """With the stamp of a message where its clock fits, else with the take; both topics do."""
    with duckdb.connect(str(fresh_database)) as connection:
        fill_case(connection, CASE.with_name("publisher_not_traced.case"))
    with msgflow.open_db(fresh_database) as db:
        scans = db.why("/planner")
        wheels = db.query("e2e-latency", to="/driver")
    said = "what publishes {} is not traced: flows begin with {}"
    assert said.format("/scan", "the stamp of each message") in scans.notes
    assert scans.paths.table["path"].to_pylist() == [
        "(not traced) → /scan → /filter → /points → /planner"
    ]
    assert wheels.notes == [
        said.format("/wheels", "its take: its clock may be another one"),
    ]
