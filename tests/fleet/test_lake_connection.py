"""Runs are chosen by their labels, and only their files are opened."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import duckdb
import pytest
from support.object_store import KEYS, ObjectStore, object_store
from support.sql_attack import ALLOWED, SECRET, answered, attack, content

from msgflow.errors import DatabaseError, UsageError
from msgflow.fleet.file_store import Store
from msgflow.fleet.lake import Lake
from msgflow.fleet.lake_connection import Reading, choose
from msgflow.fleet.lake_query import fleet_query, fleet_sql, fleet_worst
from msgflow.fleet.layout import part_path
from msgflow.fleet.run_database import open_run
from msgflow.result.query_result import QueryResult


def chosen(lake: Lake, where: str | None) -> list[str]:
    return sorted(choose(lake, where).runs["name"].to_pylist())


@pytest.mark.parametrize(
    ("where", "names"),
    [
        (None, ["copy", "first", "second"]),
        ("robot = 'r1'", ["copy", "first"]),
        ("software_version > '1.0' -- new", ["copy"]),
        ("\"soft-ware\" = 'a''b'", ["second"]),
        ("labels['soft-ware'] IS NULL AND name LIKE 'f%'", ["first"]),
        ("ROBOT IN ('r2', 'r3') OR software_version = '1.1'", ["copy", "second"]),
    ],
)
def test_a_condition_chooses_by_labels_and_columns(
    night: Lake, where: str | None, names: list[str]
) -> None:
    assert chosen(night, where) == names


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ("robott = 'r1'", r"such a label — robott.*did you mean robot\?"),
        ("site = 'x'", "has such a label — site.*labels are robot, soft-ware, software_version"),
        ("robot = 'r9'", "none of the 3 runs of the lake fits"),
        ("robot", "cannot be evaluated"),
        ("true); DROP TABLE run; --", "no condition"),
        ("robot = 'r1' LIMIT 1", "no condition"),
        ("exists (FROM read_csv('/etc/passwd'))", "Cannot access file"),
        ("robot = $x", "takes no parameters"),
    ],
)
def test_a_condition_that_is_none(night: Lake, where: str, words: str) -> None:
    with pytest.raises(UsageError, match=f"(?s){words}"):
        choose(night, where)


def test_a_label_called_like_a_column_is_not_mistaken(tmp_path: Path) -> None:
    lake = Lake.open(tmp_path / "lake", create=True)
    with pytest.raises(UsageError, match="no run yet"):
        choose(lake)
    base = {"schema_revision": "1"}
    hostile = 'a" || (SELECT 1) || "'
    lake.commit(
        {**base, "run": str(n), "name": f"n{n}", "labels": labels}
        for n, labels in enumerate(
            [{"name": "other", hostile: "x"}, {"Site": "x", "site": "y"}, {}]
        )
    )
    assert chosen(lake, "name = 'n0'") == ["n0"]
    assert chosen(lake, "labels['name'] = 'other'") == ["n0"]
    assert chosen(lake, "labels['site'] = 'y'") == ["n1"]
    assert chosen(lake, '"a"" || (SELECT 1) || """ = \'x\'') == ["n0"]
    with pytest.raises(UsageError, match="several names"):
        choose(lake, "site = 'y'")


def test_only_files_of_the_chosen_runs_are_opened(
    night: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Reading(choose(night, "robot = 'r2'"), ["flow"]) as reading:
        (files,) = reading.connection.execute("SELECT getvariable('flow')").fetchall()
        assert len(files[0]) == 1
        found = reading.connection.execute("SELECT DISTINCT run FROM flow").fetchall()
        assert [key for (key,) in found] == reading.choice.runs["run"].to_pylist()
        with pytest.raises(duckdb.CatalogException):
            reading.connection.execute("FROM topics_delivery")


def test_the_connection_reaches_nothing_else(night: Lake, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_text("a\n1\n")
    with Reading(choose(night), ["flow"]) as reading:
        con = reading.connection
        for sql in (
            f"FROM read_csv('{other}')",
            f"COPY run TO '{tmp_path / 'x.csv'}'",
            f"ATTACH '{tmp_path / 'x.duckdb'}'",
            "SET enable_external_access = true",
            "LOAD httpfs",
        ):
            with pytest.raises(duckdb.Error):
                con.execute(sql)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other.csv"]


@pytest.mark.thorough
def test_sql_on_a_lake_reads_its_tables_and_changes_no_file(night: Lake, tmp_path: Path) -> None:
    lake = tmp_path / "lake"
    shutil.copytree(night.store.url, lake)
    (tmp_path / "other.csv").write_text(f"text\n{SECRET}\n")
    # Files of the lake that no table has.
    (lake / "flow" / "other.csv").write_text(f"text\n{SECRET}\n")
    before = content(tmp_path)
    one = next(path for path in before if path.match("flow/*.parquet"))
    files = [one, tmp_path / "other.csv", lake / "flow" / "new.csv"]
    copied = Lake.open(lake)
    runs = fleet_sql(copied, "FROM run").table

    def sql(text: str, *, limit: int | None) -> QueryResult:
        return fleet_sql(copied, text, limit=limit)

    with Reading(choose(copied), ["flow"]) as reading:
        ((count,),) = reading.connection.execute("SELECT count(*) FROM flow").fetchall()
        assert count > 0
        for file in (tmp_path / "other.csv", lake / "flow" / "other.csv"):
            with pytest.raises(duckdb.PermissionException):
                reading.connection.execute(f"FROM read_text('{file}')")
    passed = answered(sql, attack(files, lake, "run", ("SELECT", "EXPLAIN", "COPY")))
    assert {each for each in passed if f"'{one}" not in each} == ALLOWED
    assert content(tmp_path) == before
    assert fleet_sql(copied, "FROM run").table.equals(runs)


def test_tables_and_views_are_those_asked_for(night: Lake) -> None:
    with Reading(choose(night), ["flow", "distribution"], ["publication", "none"]) as reading:
        tables = {
            (schema, name)
            for schema, name in reading.connection.execute(
                "SELECT schema_name, view_name FROM duckdb_views() WHERE NOT internal"
            ).fetchall()
        }
        assert tables == {("main", "flow"), ("main", "distribution"), ("view", "publication")}
        counts = reading.connection.execute(
            "SELECT count(DISTINCT run) FROM flow UNION ALL SELECT count(DISTINCT run) "
            "FROM view.publication"
        ).fetchall()
        assert counts == [(3,), (2,)]


def test_a_damaged_file_is_said(tmp_path: Path) -> None:
    lake = Lake.open(tmp_path / "lake", create=True)
    lake.commit([{"run": "1", "part": "1-x"}])
    lake.store.put("flow/1-x.parquet", b"no parquet")
    with pytest.raises(DatabaseError, match="cannot read the lake"):
        Reading(choose(lake), ["flow"])


@pytest.fixture(scope="module")
def in_bucket(night: Lake) -> Iterator[tuple[Lake, ObjectStore]]:
    """The same lake in a bucket."""
    with pytest.MonkeyPatch.context() as patch, object_store(patch) as store:
        lake = Lake(Store("s3://fleet/lake"))
        for entry in night.store.entries():
            content = night.store.read(entry.path)
            if content is not None:
                lake.store.put(entry.path, content)
        yield lake, store


@pytest.mark.thorough
def test_a_bucket_answers_as_a_folder_does(
    night: Lake, in_bucket: tuple[Lake, ObjectStore], tmp_path: Path
) -> None:
    lake, store = in_bucket
    for name, more in (
        ("e2e-latency", {"group_by": ["robot"]}),
        ("callbacks", {"where": "robot = 'r1'"}),
        ("topics-delivery", {"where": "name = 'second'"}),
    ):
        expected = fleet_query(night, name, **more).table  # type: ignore[arg-type]
        assert fleet_query(lake, name, **more).table.equals(expected)  # type: ignore[arg-type]
    text = "SELECT run, count(*) AS n, max(latency_ns) AS m FROM flow GROUP BY ALL ORDER BY ALL"
    where = "robot = 'r1'"
    assert fleet_sql(lake, text, where=where).table.equals(
        fleet_sql(night, text, where=where).table
    )
    assert len(fleet_worst(lake, "/", limit=3)) == 3
    topics = "FROM view.topic ORDER BY ALL"
    assert fleet_sql(lake, topics).table.equals(fleet_sql(night, topics).table)
    # The text for DuckDB has no credentials, and DuckDB reaches nothing itself.
    with Reading(choose(lake), ["flow"]) as reading:
        said = str(reading.connection.execute("FROM duckdb_settings()").fetchall())
        assert not any(secret in said for secret in KEYS.values() if "-east-" not in secret)
        with pytest.raises(duckdb.Error):
            reading.connection.execute("FROM read_parquet('s3://fleet/lake/flow/*.parquet')")
    target = tmp_path / "back.duckdb"
    assert open_run(lake, "first", target).path == target
    store.refuse_every = 10
    try:
        again = fleet_query(lake, "e2e-latency").table
    finally:
        store.refuse_every = 0
    assert store.refused
    assert again.equals(fleet_query(night, "e2e-latency").table)


def test_a_file_that_is_gone_is_said(in_bucket: tuple[Lake, ObjectStore]) -> None:
    lake, _ = in_bucket
    for number in (2, 0):
        path = part_path("flow", lake.runs()["part"][number].as_py())
        content = lake.store.read(path)
        assert content is not None
        lake.store.delete(path)
        with pytest.raises(DatabaseError, match="cannot read the store"):
            fleet_query(lake, "e2e-latency")
        lake.store.put(path, content)
