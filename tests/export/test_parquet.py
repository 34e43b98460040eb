"""Exports of public views: what is in the files, and how other programs read it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import duckdb
import pandas
import polars
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.golden import fill_case
from support.thorough import few, thorough

from msgflow import Database, UsageError, __version__
from msgflow.db.connection import recorded_revision
from msgflow.export.view_files import Selection

CASES = Path(__file__).resolve().parents[1] / "schema" / "cases"
LARGE = 18_446_744_073_709_551_615


@pytest.fixture
def recorded(empty_database: Path, tmp_path: Path) -> Iterator[Database]:
    """A camera, a detector and a tracker; one message of it all is at 100 ns."""
    path = tmp_path / "recorded.duckdb"
    shutil.copyfile(empty_database, path)
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, CASES / "main.flow_step" / "forward_with_internal.case")
        connection.execute(
            "UPDATE store.publisher SET gid = unhex('00ff10'), publisher_handle = $large "
            "WHERE publisher_id = 1",
            {"large": LARGE},
        )
        connection.execute("UPDATE store.node SET namespace = '' WHERE node_id = 1")
    with Database(path) as database:
        yield database


def rows(database: Database, text: str) -> list[dict[str, Any]]:
    return database.sql(text, limit=None).to_arrow().to_pylist()


def test_every_public_view_becomes_files_that_say_what_they_are(
    small_database: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with Database(small_database) as database:
        views = {row["view"] for row in database.schema().to_arrow().to_pylist()}
        exported = database.export_parquet(out)
        revision = recorded_revision(database.connection.cursor())
    assert {view.view for view in exported} == views
    assert {path.name for path in out.iterdir()} == views
    for view in exported:
        files = sorted(view.path.rglob("*.*"))
        assert [str(file.relative_to(out)) for file in files] == [
            f"{view.view}/run_id={run_id}/data.parquet" for run_id in (1, 2)
        ]
        assert sum(pq.read_metadata(file).num_rows for file in files) == view.row_count
        for file in files:
            metadata = pq.read_schema(file).metadata
            del metadata[b"pandas"]
            assert metadata == {
                b"msgflow.view": view.view.encode(),
                b"msgflow.version": __version__.encode(),
                b"msgflow.schema_revision": str(revision).encode(),
            }


def test_every_public_view_can_be_partitioned(small_database: Path) -> None:
    with Database(small_database) as database:
        described = database.schema().to_arrow().to_pylist()
    with_run = {row["view"] for row in described if row["column"] == "run_id"}
    assert with_run == {row["view"] for row in described}


@pytest.mark.parametrize(
    "view", few(["publication", "publisher", "callback_instance", "run"], "callback_instance")
)
def test_duckdb_reads_back_what_the_view_has(recorded: Database, tmp_path: Path, view: str) -> None:
    recorded.export_parquet(tmp_path / "out", [view])
    described = f"SELECT column_name, column_type FROM (DESCRIBE {view}) ORDER BY column_name"
    expected = rows(recorded, described)
    names = ", ".join(f'"{row["column_name"]}"' for row in expected)
    source = f"read_parquet('{tmp_path}/out/{view}/*/*.parquet', hive_partitioning = true)"
    with duckdb.connect() as connection:
        connection.execute(f"CREATE VIEW {view} AS SELECT {names} FROM {source}")
        assert connection.sql(described).to_arrow_table().to_pylist() == expected
        content = connection.sql(f"SELECT {names} FROM {view} ORDER BY ALL").to_arrow_table()
    assert content.to_pylist() == rows(recorded, f"SELECT {names} FROM {view} ORDER BY ALL")


def test_pyarrow_reads_back_types_and_values(recorded: Database, tmp_path: Path) -> None:
    recorded.export_parquet(tmp_path / "out", ["publisher", "publication", "take"])
    publisher = pq.read_table(tmp_path / "out" / "publisher")
    assert publisher.schema.field("gid").type == pa.binary()
    assert publisher.schema.field("publisher_handle").type == pa.uint64()
    assert publisher.schema.field("is_internal").type == pa.bool_()
    (first,) = [row for row in publisher.to_pylist() if row["publisher_id"] == 1]
    assert first["gid"] == b"\x00\xff\x10"
    assert first["publisher_handle"] == LARGE
    assert first["run_id"] == 1
    publication = pq.read_table(tmp_path / "out" / "publication")
    assert publication.schema.field("start_ns").type == pa.int64()
    assert publication["start_ns"].to_pylist() == [110, 250, 350, 270]
    assert publication["dds_ns"].null_count == 4
    assert pq.read_table(tmp_path / "out" / "take").schema.field("method").type == pa.string()


def test_pandas_keeps_integers_exact_beside_missing_values(
    recorded: Database, tmp_path: Path
) -> None:
    recorded.export_parquet(tmp_path / "out", ["publisher", "callback_instance"])
    publisher = pandas.read_parquet(tmp_path / "out" / "publisher")
    assert str(publisher.dtypes["publisher_handle"]) == "UInt64"
    assert str(publisher.dtypes["is_internal"]) == "boolean"
    assert publisher["publisher_handle"].max() == LARGE
    assert publisher["gid"][0] == b"\x00\xff\x10"
    instance = pandas.read_parquet(tmp_path / "out" / "callback_instance")
    assert str(instance.dtypes["end_ns"]) == "Int64"
    assert instance["end_ns"].isna().sum() == 1
    assert instance["end_ns"].max() == 280
    assert set(instance["run_id"].astype(int)) == {1}


@pytest.mark.thorough
def test_polars_reads_it_too(recorded: Database, tmp_path: Path) -> None:
    recorded.export_parquet(tmp_path / "out", ["publication"])
    frame = polars.read_parquet(tmp_path / "out" / "publication")
    assert frame["start_ns"].sum() == 110 + 250 + 350 + 270
    assert frame["run_id"].unique().to_list() == [1]


def test_a_run_can_be_chosen(small_database: Path, tmp_path: Path) -> None:
    with Database(small_database) as database:
        database.export_parquet(tmp_path, ["publisher", "run"], run="morning")
    assert pq.read_table(tmp_path / "publisher")["run_id"].to_pylist() == [1]
    assert pq.read_table(tmp_path / "run")["name"].to_pylist() == ["morning"]


@pytest.mark.thorough
def test_a_window_cuts_what_happened(recorded: Database, tmp_path: Path) -> None:
    """Links belong to the time of their cause; objects stay."""
    recorded.export_parquet(tmp_path, start=110, end=270)
    ids = {
        "publication": ("publication_id", [1, 2]),
        "take": ("take_id", [1, 2, 5]),
        "callback_instance": ("callback_instance_id", [2, 3]),
        "link_transport": ("publication_id", [1, 1, 1, 2]),
        "link_causal": ("callback_instance_id", [2, 2, 3]),
        "node": ("node_id", [1, 2, 3, 4]),
        "run": ("name", ["case"]),
    }
    for view, (column, expected) in ids.items():
        assert sorted(pq.read_table(tmp_path / view)[column].to_pylist()) == expected, view
    assert min(pq.read_table(tmp_path / "flow_edge")["from_ns"].to_pylist()) >= 110


def test_equal_content_gives_equal_files(small_database: Path, tmp_path: Path) -> None:
    with Database(small_database) as database:
        database.export_parquet(tmp_path / "one", ["publisher"])
        database.export_parquet(tmp_path / "two", ["publisher"])
    for partition in ("run_id=1", "run_id=2"):
        one, two = (
            tmp_path / name / "publisher" / partition / "data.parquet" for name in ("one", "two")
        )
        assert one.read_bytes() == two.read_bytes()


def test_an_export_is_replaced_only_when_told_and_then_whole(
    small_database: Path, tmp_path: Path
) -> None:
    (tmp_path / "notes.txt").write_text("precious")
    with Database(small_database) as database:
        database.export_parquet(tmp_path, ["publisher"])
        with pytest.raises(UsageError, match=r"it exists already — .*publisher"):
            database.export_parquet(tmp_path, ["node", "publisher"])
        assert not (tmp_path / "node").exists()
        database.export_parquet(tmp_path, ["publisher"], run="noon", force=True)
    assert [path.name for path in (tmp_path / "publisher").iterdir()] == ["run_id=2"]
    assert (tmp_path / "notes.txt").read_text() == "precious"
    assert {path.name for path in tmp_path.iterdir()} == {
        "notes.txt",
        "publisher",
        "msgflow.duckdb",
    }


@pytest.mark.parametrize(
    "name", ["mine.txt", "run_id=1/mine.parquet", "run_id=1/data.parquet/mine.txt"]
)
def test_a_directory_that_is_no_export_is_left_alone(
    small_database: Path, tmp_path: Path, name: str
) -> None:
    mine = tmp_path / "out" / "publisher" / name
    mine.parent.mkdir(parents=True)
    mine.write_text("precious")
    with (
        Database(small_database) as database,
        pytest.raises(UsageError, match="holds more than an export"),
    ):
        database.export_parquet(tmp_path / "out", ["publisher"], force=True)
    assert mine.read_text() == "precious"


@pytest.mark.parametrize("force", [False, True])
def test_what_fails_on_the_way_changes_nothing(
    small_database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, force: bool
) -> None:
    out = tmp_path / "out"
    with Database(small_database) as database:
        if force:
            database.export_parquet(out, ["node", "publisher"], run="morning")
        before = {path: path.read_bytes() for path in out.rglob("*.parquet")}
        calls = []

        def read(*arguments: Any) -> Any:
            calls.append(arguments)
            if len(calls) == 3:
                raise KeyboardInterrupt
            return original(*arguments)

        original = Selection.read
        monkeypatch.setattr(Selection, "read", read)
        with pytest.raises(KeyboardInterrupt):
            database.export_parquet(out, ["node", "publisher"], force=force)
    assert {path: path.read_bytes() for path in out.rglob("*.parquet")} == before
    assert bool(before) == force == out.exists()
    if force:
        assert {path.name for path in out.iterdir()} == {"node", "publisher"}


def test_what_fails_while_taking_its_place_is_undone(
    small_database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    with Database(small_database) as database:
        database.export_parquet(out, ["node", "publisher"], run="morning")
        before = {path: path.read_bytes() for path in out.rglob("*.parquet")}
        replace = Path.replace

        def fail_at_the_second(path: Path, target: Path) -> Path:
            if target.name == "publisher":
                raise OSError(28, "No space left on device")
            return replace(path, target)

        monkeypatch.setattr(Path, "replace", fail_at_the_second)
        with pytest.raises(UsageError, match="no space left on device"):
            database.export_parquet(out, ["node", "publisher"], force=True)
    assert {path: path.read_bytes() for path in out.rglob("*.parquet")} == before


def test_unknown_views_and_unusable_directories_are_named(
    small_database: Path, empty_database: Path, tmp_path: Path
) -> None:
    with Database(small_database) as database:
        with pytest.raises(UsageError) as raised:
            database.export_parquet(tmp_path, ["publishers"])
        assert raised.value.hint == "did you mean publisher"
        with pytest.raises(UsageError, match="cannot create the directory"):
            database.export_parquet(small_database)
        with pytest.raises(UsageError, match="counts from the start of a run"):
            database.export_parquet(tmp_path, start="1s")
    with (
        Database(empty_database) as database,
        pytest.raises(UsageError, match="holds no run yet"),
    ):
        database.export_parquet(tmp_path)


def test_csv_tells_empty_and_missing_apart(recorded: Database, tmp_path: Path) -> None:
    exported = recorded.export_csv(tmp_path / "out", ["publisher", "node"])
    assert [(view.view, view.path.name, view.row_count) for view in exported] == [
        ("node", "node.csv", 4),
        ("publisher", "publisher.csv", 4),
    ]
    lines = (tmp_path / "out" / "publisher.csv").read_text().splitlines()
    assert lines[0].startswith('"publisher_id","run_id","process_id","node_id","topic_name",')
    assert lines[1] == f'1,1,1,1,"/image",{LARGE},,"00ff10",,,false,false,false,false'
    nodes = (tmp_path / "out" / "node.csv").read_text().splitlines()
    assert nodes[1:3] == ['1,1,1,,"","/camera",,,false', '2,1,1,,,"/detector",,,false']


@pytest.mark.thorough
def test_csv_can_be_read_back(recorded: Database, tmp_path: Path) -> None:
    out = tmp_path / "out"
    exported = recorded.export_csv(out)
    with duckdb.connect() as connection:
        for view in exported:
            source = f"read_csv('{view.path}', header = true, all_varchar = true)"
            columns = [row[0] for row in connection.sql(f"DESCRIBE FROM {source}").fetchall()]
            assert columns == list(recorded.sql(f"FROM {view.view}").columns)
            assert connection.sql(f"SELECT count(*) FROM {source}").fetchall() == [
                (view.row_count,)
            ]
        total = f"SELECT sum(start_ns) AS total FROM read_csv('{out}/publication.csv')"
        assert connection.sql(total).fetchall() == [(110 + 250 + 350 + 270,)]
    frame = pandas.read_csv(out / "callback_instance.csv", dtype_backend="numpy_nullable")
    assert str(frame.dtypes["end_ns"]) == "Int64"
    with pytest.raises(UsageError, match="exists already"):
        recorded.export_csv(out, ["node"])
    recorded.export_csv(out, ["node"], force=True)


def test_equal_results_are_equal_in_csv(recorded: Database, tmp_path: Path) -> None:
    """A file of an export is what `msgflow sql --format csv` writes."""
    from msgflow.export.formats import Format, write_result

    recorded.export_csv(tmp_path / "out", ["take"])
    result = recorded.sql("FROM take ORDER BY ALL")
    with (tmp_path / "sql.csv").open("wb") as stream:
        write_result(result, Format.CSV, stream)
    assert (tmp_path / "out" / "take.csv").read_bytes() == (tmp_path / "sql.csv").read_bytes()


@pytest.mark.thorough
@pytest.mark.parametrize("write", [Database.export_parquet, thorough(Database.export_csv)])
def test_a_view_of_somebody_else_becomes_no_file(
    small_database: Path, tmp_path: Path, write: Callable[..., object]
) -> None:
    """Its name might be a path: this one is that of a file that matters."""
    path, out = tmp_path / "foreign.duckdb", tmp_path / "out"
    shutil.copyfile(small_database, path)
    victim = tmp_path / "victim"
    victim.mkdir()
    (victim / "letter.csv").write_text("matters")
    names = ["../victim/letter", f"{victim}/letter", "own"]
    with duckdb.connect(str(path)) as connection:
        for name in names:
            connection.execute(f'CREATE VIEW main."{name}" AS SELECT run_id FROM store.run')
    with Database(path) as database:
        write(database, out, force=True)
        for name in names:
            with pytest.raises(UsageError, match="there is no such view"):
                write(database, out, [name], force=True)
    assert [file.name for file in victim.iterdir()] == ["letter.csv"]
    assert (victim / "letter.csv").read_text() == "matters"
    assert not [entry for entry in out.iterdir() if entry.name.startswith("own")]
    assert (out / "node" / "run_id=1").exists() or (out / "node.csv").exists()
