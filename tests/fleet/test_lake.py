"""A lake shows each run once and whole to readers that follow docs/fleet.md."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from support.lakes import EXAMPLE, PAGE, content, paths, read, rows_of
from typer.testing import CliRunner

from msgflow import Database
from msgflow.cli.app import app
from msgflow.errors import DatabaseError, UsageError
from msgflow.fleet.file_store import Store
from msgflow.fleet.lake import Lake
from msgflow.fleet.lake_query import fleet_sql
from msgflow.fleet.layout import RUN_SCHEMA, part_path, run_path
from msgflow.fleet.part import ANSWERS, write_part

Row = dict[str, Any]


def write(lake: Lake, database: Path, scratch: Path) -> Row:
    """Write the answers of a database into a lake, without a commit."""
    with Database(database) as opened:
        return write_part(opened.connection, database, lake.store, scratch, database=False)


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    return Lake.open(tmp_path / "lake", create=True)


@pytest.fixture
def holding(written: tuple[Path, Row, Row], tmp_path: Path) -> tuple[Lake, Row, Row]:
    """A copy of it, to change it."""
    shutil.copytree(written[0], tmp_path / "holding")
    return Lake.open(tmp_path / "holding"), *written[1:]


def test_a_run_is_there_when_its_row_is(holding: tuple[Lake, Row, Row]) -> None:
    lake, part, _ = holding
    assert lake.runs().num_rows == 0
    labels = {"robot": 'the "first"', "site": "a\nb, 'c'"}
    lake.commit([{**part, "labels": labels}])
    (run,) = lake.runs().to_pylist()
    assert dict(run["labels"]) == labels
    assert run["run"] == part["run"]
    assert (run["event_count"], run["name"]) == (part["event_count"], "first")
    assert read(lake, "SELECT labels['site'] FROM run") == [("a\nb, 'c'",)]
    assert rows_of(lake, "flow")


def test_answers_are_those_of_the_database(
    holding: tuple[Lake, Row, Row], databases: tuple[Path, Path]
) -> None:
    lake, part, _ = holding
    lake.commit([part])
    with Database(databases[0]) as database:
        for name in ("e2e-latency", "callbacks", "topics-delivery"):
            expected = database.query(name, internal=True).to_arrow().drop_columns(["run_id"])
            # Arrow has the entries of a map as a list.
            found = [
                tuple(list(v.items()) if isinstance(v, dict) else v for v in values[1:])
                for values in rows_of(lake, name.replace("-", "_"))
            ]
            assert found == sorted(map(tuple, (r.values() for r in expected.to_pylist())))
        flows = database.query("flows").to_arrow()
        p99 = dict(
            database.sql(
                "SELECT path, quantile_disc(latency_ns, 0.99) FROM end_to_end([1]) "
                "JOIN flow_path([1]) USING (path_id) WHERE is_first AND status = 'reached' "
                "GROUP BY path"
            )
            .to_pandas()
            .itertuples(index=False, name=None)
        )
    assert {path: value for _, path, value in read(lake, EXAMPLE)} == p99
    assert len(read(lake, EXAMPLE)) == len(p99) > 0
    # One row per root; of a root that did not arrive, nothing is the first arrival.
    first = [r for r in rows_of(lake, "flow") if r[12] is not False]
    assert len(first) == len(flows)


def test_runs_add_up(holding: tuple[Lake, Row, Row]) -> None:
    """A quantile of several runs, from counts in buckets, is off by less than 1 %."""
    lake, *parts = holding
    lake.commit(parts)
    (exact,) = (
        fleet_sql(
            lake,
            "SELECT quantile_disc(end_ns - start_ns, [0.05, 0.5, 0.9, 0.99, 1]) AS exact"
            " FROM view.callback_instance",
        )
        .table["exact"]
        .to_pylist()
    )
    counted = read(
        lake,
        "WITH b AS (SELECT bucket, sum(count) AS count FROM"
        " read_parquet('LAKE/distribution/*.parquet') WHERE measure = 'callback_duration'"
        " GROUP BY bucket), c AS (SELECT bucket, sum(count) OVER (ORDER BY bucket) AS upto,"
        " sum(count) OVER () AS total FROM b), q AS (SELECT unnest([0.05, 0.5, 0.9, 0.99, 1]) AS q)"
        " SELECT q, 2 / 2.02 * pow(1.02, min(bucket) - 1) FROM q, c WHERE upto >= ceil(q * total)"
        " GROUP BY q ORDER BY q",
    )
    assert [value for _, value in counted] == pytest.approx(exact, rel=0.0101)


@pytest.mark.thorough
def test_writing_again_leaves_what_is_there(
    holding: tuple[Lake, Row, Row], databases: tuple[Path, Path], tmp_path: Path
) -> None:
    """The rows are the same, in files of their own."""
    lake, first, _ = holding
    before = {entry.path: lake.store.read(entry.path) for entry in lake.store.entries()}
    again = write(lake, databases[0], tmp_path)
    assert first["part"] != again["part"]
    names = {"part", "database_part"}
    assert {**first, **dict.fromkeys(names)} == {**again, **dict.fromkeys(names)}
    for table in ANSWERS:
        one, other = (
            pq.ParquetFile(lake.store.full(part_path(table, row["part"]))).read()
            for row in (first, again)
        )
        assert one["part"].unique().to_pylist() in ([], [first["part"]])
        assert one.drop_columns(["part"]).equals(other.drop_columns(["part"]))
    assert {path: lake.store.read(path) for path in before} == before


def test_the_last_row_of_a_run_counts(
    holding: tuple[Lake, Row, Row], databases: tuple[Path, Path], tmp_path: Path
) -> None:
    lake, first, other = holding
    lake.commit([first, other])
    flows = rows_of(lake, "flow")
    # Twice, as by two workers that did the same.
    lake.commit([first])
    assert rows_of(lake, "flow") == flows
    replaced = write(lake, databases[0], tmp_path)
    assert rows_of(lake, "flow") == flows
    for last in (replaced, first, replaced):
        lake.commit([last])
        assert rows_of(lake, "flow") == flows
        parts = {run["run"]: run["part"] for run in lake.runs().to_pylist()}
        assert parts[first["run"]] == last["part"]
    lake.remove([first["run"]])
    assert [run["run"] for run in lake.runs().to_pylist()] == [other["run"]]
    assert {values[0] for values in rows_of(lake, "flow")} == {other["run"]}
    with pytest.raises(UsageError, match="no such run"):
        lake.remove([other["run"], first["run"]])
    for key in ("\0", f"../run/{other['run']}"):
        with pytest.raises(UsageError, match="no such run"):
            lake.remove([key])
    assert len(lake.runs()) == 1


def test_files_say_what_they_are(holding: tuple[Lake, Row, Row]) -> None:
    lake, part, _ = holding
    lake.commit([part])
    flow = part_path("flow", part["part"])
    for path, table in ((flow, "flow"), (run_path(part["run"]), "run")):
        meta = pq.read_schema(lake.store.full(path)).metadata
        assert meta[b"msgflow.table"] == table.encode()
        assert meta[b"msgflow.lake_revision"] == b"3"
        assert meta[b"msgflow.schema_revision"] == part["schema_revision"].encode()
        assert b"msgflow.version" in meta


def test_the_page_names_all_tables_and_columns() -> None:
    lake_section = PAGE.split("### Why not")[0]
    for table in ANSWERS:
        assert f"`{table}`" in lake_section
    for name in RUN_SCHEMA.names:
        assert f"`{name}`" in lake_section


def test_what_is_no_lake_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="no lake"):
        Lake.open(tmp_path / "nothing")
    (tmp_path / "file").write_text("mine")
    with pytest.raises(DatabaseError, match="something else than a lake"):
        Lake.open(tmp_path, create=True)
    assert sorted(tmp_path.iterdir()) == [tmp_path / "file"]
    for text, words in (
        ('{"format": "msgflow lake", "revision": 4}', "newer than this msgflow knows"),
        ('{"format": "msgflow lake", "revision": 2}', r"(?s)older than .*ingest .* a new lake"),
        ('{"format": "another"}', "not that of a lake"),
        ("[]", "not that of a lake"),
    ):
        (tmp_path / "lake.json").write_text(text)
        for create in (False, True):
            with pytest.raises(DatabaseError, match=words):
                Lake.open(tmp_path, create=create)


def test_a_damaged_row_of_runs_is_said(lake: Lake) -> None:
    lake.store.put("run/x.parquet", b"no parquet")
    with pytest.raises(DatabaseError, match="cannot read the runs"):
        lake.runs()


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("s3://key:secret@bucket/lake", "no credentials in an address"),
        ("s3://bucket/lake?secret_key=x", "no address of a bucket"),
        ("s3://", "no address of a bucket"),
        ("s3://bucket/../../other", "no address of a bucket"),
        ("gs://bucket/lake", "neither a folder nor a bucket"),
    ],
)
def test_addresses_that_are_none(url: str, words: str) -> None:
    with pytest.raises(UsageError, match=words) as raised:
        Store(url)
    assert "secret@" not in str(raised.value)


def test_the_address_of_a_store_has_a_scheme(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AWS_ENDPOINT_URL", "127.0.0.1:9")
    with pytest.raises(UsageError, match="AWS_ENDPOINT_URL is no address of a store"):
        Store("s3://bucket/lake").read("x")


def test_a_file_appears_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = Store(tmp_path)
    store.put("a/b", b"before")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(DatabaseError, match="No space left on device"):
        store.put("a/b", b"after")
    assert store.read("a/b") == b"before"
    assert [entry.path for entry in store.entries()] == ["a/b"]
    store.delete("a/b")
    assert store.read("a/b") is None


def aged(lake: Lake, hours: int = 25) -> None:
    """Let all files be so old."""
    for entry in lake.store.entries():
        os.utime(lake.store.full(entry.path), ns=(0, time.time_ns() - hours * 3_600 * 10**9))


def test_what_no_run_needs_is_deleted(
    holding: tuple[Lake, Row, Row], databases: tuple[Path, Path], tmp_path: Path
) -> None:
    lake, first, other = holding
    lake.commit([first, other])
    again = write(lake, databases[0], tmp_path)
    lake.commit([again])
    unfinished = [lake.store.full(f"flow/{'f' * 20}-0123456789.parquet")]
    unfinished += [lake.store.full("flow/.x.parquet.mark.part")]
    kept = [lake.store.full(name) for name in ("flow/notes.txt", "lake.json")]
    for file in (*unfinished, kept[0]):
        shutil.copy(lake.store.full(part_path("flow", first["part"])), file)
    before, files = content(lake), paths(lake, "")
    # Another process may be about to commit what is less than a day old.
    aged(lake, hours=23)
    assert lake.clean_up() == (0, 0)
    assert paths(lake, "") == files
    aged(lake)
    number, size = lake.clean_up()
    assert number == len(ANSWERS) + 1 + len(unfinished)
    assert size > 10_000
    assert content(lake) == before
    assert not any(first["part"] in path for path in paths(lake, ""))
    assert all(map(os.path.exists, kept))
    # Those of a run that is removed go at once.
    given = ["fleet", "remove", other["run"], "--lake", lake.store.url]
    said = CliRunner().invoke(app, given).stderr
    assert f"1 run and {len(ANSWERS) + 1} files of " in said
    assert rows_of(lake, "flow")
    assert not any(other["run"] in path for path in paths(lake, ""))
    lake.clean_up(lake.remove([again["run"]]))
    assert paths(lake, "") == {"lake.json", "flow/notes.txt"}


def test_no_answers_are_deleted_where_runs_are_out_of_sight(
    holding: tuple[Lake, Row, Row], tmp_path: Path
) -> None:
    """The file system with the folder `run` may not be mounted."""
    lake, *rows = holding
    lake.commit(rows)
    aged(lake)
    Path(lake.store.full("run")).rename(tmp_path / "run")
    files = paths(lake, "")
    with pytest.raises(DatabaseError, match=r"the lake has no run — .*/run"):
        lake.clean_up()
    assert paths(lake, "") == files
