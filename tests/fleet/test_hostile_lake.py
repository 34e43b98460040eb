"""Lakes, manifests and folders that somebody prepared: nothing outside is touched, all is said."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pyarrow.parquet
import pytest
from typer.testing import CliRunner

from msgflow.cli.app import app
from msgflow.errors import DatabaseError, QueryError, UsageError
from msgflow.fleet.file_store import Store
from msgflow.fleet.lake import Lake
from msgflow.fleet.lake_query import fleet_sql
from msgflow.fleet.layout import RUN_SCHEMA, database_path
from msgflow.fleet.run_database import open_run
from msgflow.fleet.sources import read_manifest
from msgflow.trace import extraction
from msgflow_sim import simulate

LARGEST = 2**63 - 1


@pytest.fixture
def lake(night: Lake, tmp_path: Path) -> Lake:
    """A lake of one's own."""
    return Lake.open(shutil.copytree(night.store.url, tmp_path / "lake"))


def put_row(lake: Lake, **values: Any) -> str:
    """Write a row of the table `run` and return the address of its file."""
    row: dict[str, Any] = dict.fromkeys(RUN_SCHEMA.names)
    row |= {"run": "feed", "committed_ns": 1} | values
    lake.put_table("run/feed.parquet", "run", pa.Table.from_pylist([row], RUN_SCHEMA), "0001")
    return lake.store.url_of("run/feed.parquet")


@pytest.mark.parametrize("ray", [None, pytest.param("local", marks=pytest.mark.thorough)])
def test_no_module_of_the_current_folder_is_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ray: str | None
) -> None:
    """Nor is anything lost there: events of one's own are in the lake."""
    folder = tmp_path / "recordings"
    simulate("own_events", folder / "r0", factor=0.01)
    for name in ("duckdb", "queue", "msgflow"):
        (folder / f"{name}.py").write_text(f"open({str(tmp_path / 'run')!r}, 'a')\n")
    monkeypatch.chdir(folder)
    if ray is not None:
        pytest.importorskip("ray", reason="ray is not installed")
    given = ["fleet", "ingest", "r0", "--lake", str(tmp_path / "lake"), "--events", "my_pkg:*"]
    done = CliRunner().invoke(app, [*given, *([] if ray is None else ["--ray", ray])])
    assert done.exit_code == 0, done.stderr
    assert not (tmp_path / "run").exists()
    found = fleet_sql(Lake.open(tmp_path / "lake"), "SELECT DISTINCT name FROM view.user_event")
    assert found.table["name"].to_pylist() == ["my_pkg:frame_done"]


@pytest.mark.parametrize("kind", ["folder", "pipe"])
def test_what_is_no_file_among_the_runs_is_an_error(lake: Lake, kind: str) -> None:
    """It would look like a run that is gone, and what belongs to it would be deleted."""
    place = Path(lake.store.url) / "run" / "stranger.parquet"
    if kind == "folder":
        place.mkdir()
    else:
        os.mkfifo(place)
    with pytest.raises(DatabaseError, match=r"no file — .*run/stranger\.parquet"):
        lake.clean_up()


def test_files_behind_links_are_errors(lake: Lake, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    link = Path(lake.store.url) / "run" / "linked"
    link.symlink_to(tmp_path / "secret")
    store = lake.store
    assert "run/linked" not in [entry.path for entry in store.entries("run")]
    for use in (
        lambda: store.read("run/linked"),
        lambda: store.entry("run/linked"),
        lambda: store.fetch("run/linked", tmp_path / "copy"),
        lambda: store.put("run/linked", b"new"),
        lambda: store.delete("run/linked"),
    ):
        with pytest.raises(DatabaseError, match=f"no symbolic link below a lake — {link}"):
            use()
    assert link.is_symlink()
    assert (tmp_path / "secret").read_text() == "secret"
    # The lake itself may be reached through one, and so may recordings.
    (tmp_path / "here").symlink_to(store.url)
    assert len(Lake.open(tmp_path / "here").runs()) == 3
    assert Store(store.url).read("run/linked") == b"secret"


def test_a_part_cannot_lead_out_of_the_lake(lake: Lake) -> None:
    url = put_row(lake, part="../../../outside")
    with pytest.raises(DatabaseError, match=f"a part that is no name — {url}"):
        lake.runs()


def test_a_run_is_in_its_own_file(lake: Lake) -> None:
    """A copy of it under another name could not be replaced or removed."""
    file = Path(lake.store.url) / "run" / f"{lake.runs()['run'][0]}.parquet"
    shutil.copy(file, file.with_name("copy.parquet"))
    with pytest.raises(DatabaseError, match=r"another name than its run — .*copy\.parquet"):
        lake.runs()


@pytest.mark.parametrize(
    "values",
    [
        {"part": None},
        {"part": "p", "committed_ns": LARGEST},
        {"committed_ns": None},
    ],
)
def test_a_strange_run_can_be_removed(lake: Lake, values: dict[str, Any]) -> None:
    put_row(lake, **values)
    assert "feed" in lake.runs()["run"].to_pylist()
    lake.clean_up(lake.remove(["feed"]))
    assert len(Lake.open(lake.store.url).runs()) == 3


DEEP = "[" * 200_000


def test_deep_json_is_no_lake(tmp_path: Path) -> None:
    (tmp_path / "lake.json").write_text(DEEP)
    with pytest.raises(DatabaseError, match="not that of a lake"):
        Lake.open(tmp_path)


@pytest.mark.parametrize("place", ["m.csv", "lake.json"])
@pytest.mark.parametrize("kind", ["pipe", "device", "huge"])
def test_only_small_regular_files_are_read(tmp_path: Path, place: str, kind: str) -> None:
    path = tmp_path / place
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        with path.open("wb") as file:
            file.truncate(10**10)
    if place == "lake.json" and kind == "device":
        words, found = "no symbolic link", (DatabaseError, UsageError)
    else:
        words = {"pipe": "a pipe, no file", "device": "a device, no file", "huge": "more than"}[
            kind
        ]
        found = (DatabaseError, UsageError)
    with pytest.raises(found, match=words):
        Lake.open(tmp_path) if place == "lake.json" else read_manifest(str(path))


def test_a_database_that_is_larger_than_it_may_be_is_not_unpacked(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = next(row for row in lake.runs().to_pylist() if row["name"] == "first")
    sink = pa.BufferOutputStream()
    with pa.CompressedOutputStream(sink, "zstd") as packing:
        packing.write(bytes(3 << 20))
    lake.store.put(database_path(row["database_part"]), sink.getvalue().to_pybytes())
    monkeypatch.setattr(extraction, "MOST_UNPACKED", 1 << 20)
    with pytest.raises(DatabaseError, match="more than 1,048,576 bytes unpacked") as raised:
        open_run(lake, row["run"], tmp_path / "x.duckdb")
    assert "MSGFLOW_UNPACK_LIMIT" in (raised.value.hint or "")
    assert not list(tmp_path.glob("*x.duckdb*"))


@pytest.mark.parametrize(
    "url",
    [
        "s3://key:sec/ret@bucket/lake",
        "s3://key:se@cret@bucket/x",
        "http://u:secret@h/x",
        "postgres:u:secret@h/x",
    ],
)
def test_passwords_in_addresses_are_not_printed(url: str) -> None:
    with pytest.raises(UsageError, match="no credentials") as raised:
        Store(url)
    assert not re.search("ret(?!s)|cret|sec", raised.value.message)


@pytest.mark.parametrize("name", ["./a:b:c@d", "2025-03-01T10:00:00@robot", "a:b@c", "/a//b@c"])
def test_a_folder_may_have_a_name_like_an_address(name: str) -> None:
    assert Store(name).url == os.path.abspath(name)


@pytest.mark.parametrize("url", ["ftp://u:pa/ss@host", "u:pa/ss@host:9", "http://u:pa%2fss@h"])
def test_passwords_in_endpoints_are_not_printed(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AWS_ENDPOINT_URL", url)
    with pytest.raises(UsageError, match="AWS_ENDPOINT_URL is no address of a store") as raised:
        Store("s3://bucket/lake").read("x")
    assert "ss@" not in str(raised.value)


@pytest.mark.parametrize("is_folder", [True, False])
def test_no_runs_that_are_elsewhere_are_lost(lake: Lake, is_folder: bool) -> None:
    root = Path(lake.store.url)
    key = lake.keys()[0]
    link = root / "run" if is_folder else root / "run" / f"{key}.parquet"
    moved = link.replace(root.parent / "moved.parquet")
    link.symlink_to(moved)
    files = {path for path in root.rglob("*") if path.is_file()}
    for use in (lake.clean_up, lake.runs, lambda: lake.remove([key])):
        with pytest.raises(DatabaseError, match=rf"no symbolic link below a lake — {link}"):
            use()
    assert {path for path in root.rglob("*") if path.is_file()} == files


def test_commands_are_quoted(lake: Lake) -> None:
    lake.commit([{"run": "x; touch PWN", "name": "$(touch PWN)"}])
    listed = CliRunner().invoke(app, ["fleet", "open", "no such", "--lake", f"{lake.store.url}/."])
    assert listed.exit_code == 2
    with pytest.raises(UsageError) as raised:
        open_run(lake, "x; touch PWN")
    assert raised.value.hint == "msgflow ingest ''"


def test_names_of_views_are_neither_paths_nor_sql(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of a database in the lake."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    row = next(each for each in lake.runs().to_pylist() if each["database_part"] is not None)
    packed = Path(lake.store.url, database_path(row["database_part"]))
    database = tmp_path / "run.duckdb"
    with pa.input_stream(packed, compression="zstd") as stream:
        database.write_bytes(stream.read())
    with duckdb.connect(str(database)) as connection:
        connection.execute('CREATE VIEW main."../../../victim" AS SELECT 1 AS x')
    with pa.output_stream(packed, compression="zstd") as sink:
        sink.write(database.read_bytes())
    before = {path for path in tmp_path.rglob("*") if "temporary" not in path.parts}
    given = {"where": f"run = '{row['run']}'"}
    assert len(fleet_sql(lake, "FROM view.publication", **given))
    with pytest.raises(QueryError):
        fleet_sql(lake, 'FROM view."../../../victim"', **given)
    assert {path for path in tmp_path.rglob("*") if "temporary" not in path.parts} == before
    assert not any((tmp_path / "temporary").iterdir())
