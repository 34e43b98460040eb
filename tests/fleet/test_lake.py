"""A lake shows each run once and whole to readers that follow docs/fleet.md."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import duckdb
import pyarrow.parquet as pq
import pytest

from msgflow import Database
from msgflow.errors import DatabaseError, UsageError
from msgflow.fleet.answers import answers
from msgflow.fleet.compact import compact
from msgflow.fleet.file_store import Store
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import run_schema, view_path
from msgflow.fleet.part import Content, Part, part_name, write_part

DOCS = Path(__file__).resolve().parents[2] / "docs" / "fleet.md"
PAGE = DOCS.read_text(encoding="utf-8")
_ANSWERS = Content(views=False, database=False)
CREATE_RUN, EXAMPLE = (
    text
    for block in re.findall(r"```sql\n(.*?)```", PAGE, re.DOTALL)
    for text in block.split("\n\n")
)


def write(lake: Lake, database: Path, scratch: Path, **more: Any) -> Part:
    """Write the files of a database into a lake, without a commit."""
    given: dict[str, Any] = {"source": "here", "options": {}, "content": _ANSWERS}
    with Database(database) as opened:
        return write_part(opened.connection, database, lake.store, scratch, **given | more)


def row(part: Part, generation: int = 1, **more: Any) -> dict[str, Any]:
    return {**part.values, "generation": generation, **more}


def read(lake: Lake, sql: str) -> list[tuple[Any, ...]]:
    """Return what SQL of the docs returns, of somebody who has no msgflow."""
    with duckdb.connect() as con:
        con.execute(CREATE_RUN.replace("LAKE", lake.store.url))
        return con.execute(sql.replace("LAKE", lake.store.url)).fetchall()


def rows_of(lake: Lake, table: str) -> list[tuple[Any, ...]]:
    return read(
        lake,
        f"SELECT t.* EXCLUDE part FROM read_parquet('LAKE/{table}/*/*.parquet', "
        "hive_partitioning = true) AS t JOIN run USING (run, part) ORDER BY ALL",
    )


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    return Lake.open_or_create(tmp_path / "lake")


@pytest.fixture
def holding(written: tuple[Path, Part, Part], tmp_path: Path) -> tuple[Lake, Part, Part]:
    """A copy of it, to change it."""
    shutil.copytree(written[0], tmp_path / "holding")
    return Lake.open(tmp_path / "holding"), *written[1:]


def test_a_run_is_there_when_its_row_is(holding: tuple[Lake, Part, Part]) -> None:
    lake, part, _ = holding
    assert lake.runs().num_rows == 0
    labels = {"robot": 'the "first"', "site": "a\nb, 'c'"}
    lake.commit([row(part, labels=labels)])
    (run,) = lake.runs().to_pylist()
    assert dict(run["labels"]) == labels
    assert run["run"] == part.values["run"]
    assert (run["event_count"], run["name"]) == (part.values["event_count"], "first")
    assert read(lake, "SELECT labels['site'] FROM run") == [("a\nb, 'c'",)]
    assert rows_of(lake, "flow")


def test_answers_are_those_of_the_database(
    holding: tuple[Lake, Part, Part], databases: tuple[Path, Path]
) -> None:
    lake, part, _ = holding
    lake.commit([row(part)])
    with Database(databases[0]) as database:
        for name in ("e2e-latency", "callbacks", "topics-delivery"):
            expected = database.query(name, internal=True).to_arrow().drop_columns(["run_id"])
            found = [values[1:] for values in rows_of(lake, name.replace("-", "_"))]
            assert found == sorted(map(tuple, (r.values() for r in expected.to_pylist())))
        flows = database.query("flows").to_arrow()
        for view in ("publication", "link_transport", "topic"):
            expected_rows = database.sql(
                f"SELECT * EXCLUDE run_id FROM {view} ORDER BY ALL", limit=None
            ).to_arrow()
            found = read(
                lake,
                f"SELECT * EXCLUDE (run, part) FROM read_parquet('LAKE/view/{view}/*/*.parquet', "
                "hive_partitioning = true) JOIN (SELECT run, view_part AS part FROM run) "
                "USING (run, part) ORDER BY ALL",
            )
            assert found == [tuple(r.values()) for r in expected_rows.to_pylist()]
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
    first = [r for r in rows_of(lake, "flow") if r[12]]
    assert len(first) == len(flows)


def test_runs_add_up(holding: tuple[Lake, Part, Part]) -> None:
    """A quantile of several runs, from counts in buckets, is off by less than 1 %."""
    lake, *parts = holding
    lake.commit(row(part) for part in parts)
    exact = read(
        lake,
        "SELECT quantile_disc(end_ns - start_ns, [0.05, 0.5, 0.9, 0.99, 1])"
        " FROM read_parquet('LAKE/view/callback_instance/*/*.parquet')",
    )[0][0]
    counted = read(
        lake,
        "WITH b AS (SELECT bucket, sum(count) AS count FROM"
        " read_parquet('LAKE/distribution/*/*.parquet') WHERE measure = 'callback_duration'"
        " GROUP BY bucket), c AS (SELECT bucket, sum(count) OVER (ORDER BY bucket) AS upto,"
        " sum(count) OVER () AS total FROM b), q AS (SELECT unnest([0.05, 0.5, 0.9, 0.99, 1]) AS q)"
        " SELECT q, 2 / 2.02 * pow(1.02, min(bucket) - 1) FROM q, c WHERE upto >= ceil(q * total)"
        " GROUP BY q ORDER BY q",
    )
    assert [value for _, value in counted] == pytest.approx(exact, rel=0.0101)


def test_writing_again_writes_the_same(
    holding: tuple[Lake, Part, Part], databases: tuple[Path, Path], tmp_path: Path
) -> None:
    lake, first, _ = holding
    source = "/recordings/first"
    before = {entry.path: lake.store.read(entry.path) for entry in lake.store.entries()}
    again = write(lake, databases[0], tmp_path, source=source, content=Content())
    assert again.values == first.values
    assert {entry.path: lake.store.read(entry.path) for entry in lake.store.entries()} == before
    # What depends on anything else lies elsewhere.
    assert first.values["part"] == part_name(first.values["run"], source, {})
    assert first.values["part"] != part_name(first.values["run"], "there", {})
    assert first.values["part"] != part_name(first.values["run"], source, {"strict": True})


def test_the_last_row_of_a_run_counts(
    holding: tuple[Lake, Part, Part], databases: tuple[Path, Path], tmp_path: Path
) -> None:
    lake, first, other = holding
    lake.commit([row(first), row(other)])
    count = len(rows_of(lake, "flow"))
    # Twice, as by two workers that did the same.
    lake.commit([row(first)])
    assert len(rows_of(lake, "flow")) == count
    replaced = write(lake, databases[0], tmp_path, options={"strict": True})
    assert len(rows_of(lake, "flow")) == count
    lake.commit([row(replaced, 2)])
    assert len(rows_of(lake, "flow")) == count
    # One that comes late with an earlier generation.
    lake.commit([row(first, 1)])
    parts = {run["run"]: run["part"] for run in lake.runs().to_pylist()}
    assert parts[first.values["run"]] == replaced.values["part"]
    lake.remove([first.values["run"]])
    assert [run["run"] for run in lake.runs().to_pylist()] == [other.values["run"]]
    assert {values[0] for values in rows_of(lake, "flow")} == {other.values["run"]}
    with pytest.raises(UsageError, match="no such run"):
        lake.remove([first.values["run"]])


def test_files_say_what_they_are(holding: tuple[Lake, Part, Part]) -> None:
    lake, part, _ = holding
    lake.commit([row(part)])
    (flow,) = lake.files("flow", lake.runs())
    (run,) = lake.run_files()
    (view_part,) = lake.runs()["view_part"].to_pylist()
    view = view_path("node", view_part)
    for path, table in ((flow, "flow"), (run, "run"), (view, "node")):
        meta = pq.read_schema(lake.store.full(path)).metadata
        assert meta[b"msgflow.table"] == table.encode()
        assert meta[b"msgflow.lake_revision"] == b"1"
        assert meta[b"msgflow.schema_revision"] == part.values["schema_revision"].encode()
        assert b"msgflow.version" in meta


def test_the_page_names_all_tables_and_columns() -> None:
    lake_section = PAGE.split("### Why not")[0]
    for answer in answers():
        assert f"`{answer.table}`" in lake_section
    for name in run_schema().names:
        assert f"`{name}`" in lake_section


def test_what_is_no_lake_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="no lake"):
        Lake.open(tmp_path / "nothing")
    (tmp_path / "file").write_text("mine")
    with pytest.raises(DatabaseError, match="something else than a lake"):
        Lake.open_or_create(tmp_path)
    assert sorted(tmp_path.iterdir()) == [tmp_path / "file"]
    for text, words in (
        ('{"format": "msgflow lake", "revision": 2}', "newer than this msgflow knows"),
        ('{"format": "another"}', "not that of a lake"),
        ("[]", "not that of a lake"),
    ):
        (tmp_path / "lake.json").write_text(text)
        for opened in (Lake.open, Lake.open_or_create):
            with pytest.raises(DatabaseError, match=words):
                opened(tmp_path)


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
    assert not (tmp_path / "a").exists()


def test_files_of_runs_are_put_together_and_nothing_changes(tmp_path: Path) -> None:
    lake = Lake.open_or_create(tmp_path / "lake")
    base = {"generation": 1, "is_removed": False, "schema_revision": "1"}
    for number in range(9):
        lake.commit([{**base, "run": f"{number:020}", "part": f"{number}-x"}])
    lake.remove([f"{3:020}"])
    before = lake.runs()
    loose = lake.run_files()
    assert lake.put_together() == 10
    assert lake.put_together() == 0
    # Read by those who know nothing of it, too, and still what counts is read once.
    assert len(read(lake, "FROM run")) == 8
    assert lake.runs().equals(before)
    assert len(lake.rows()) == 10
    # What the new file stands for is not read any more.
    lake.store.put(loose[0], b"no parquet")
    assert Lake.open(tmp_path / "lake").runs().equals(before)
    lake.commit([{**base, "run": f"{0:020}", "part": "again", "generation": 2}])
    for number in range(20, 28):
        lake.commit([{**base, "run": f"{number:020}", "part": f"{number}-x"}])
    assert lake.runs()["part"][0].as_py() == "again"
    after = lake.runs()
    lake.put_together()
    assert lake.runs().equals(after)
    kept = set(lake.run_files())
    assert kept > set(loose)
    compact(lake, older_than=3600)
    assert kept < set(lake.run_files())
    compact(lake, older_than=0)
    assert len(lake.run_files()) < 3
    assert lake.runs()["run"].equals(after["run"])
    lake.store.put(lake.run_files()[0].replace("together-", "together-x"), b"no parquet")
    with pytest.raises(DatabaseError, match="cannot read the runs"):
        Lake.open(tmp_path / "lake").runs()
