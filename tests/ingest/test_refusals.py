"""What cannot be ingested, and databases that cannot be ingested into: nothing changes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import UUID

import duckdb
import pytest

from msgflow.errors import DatabaseError, ExitCode, TraceError, UsageError
from msgflow.ingest import ingest

ROS = {"ros2:rcl_init": {"context_handle": "u64", "version": "str"}}
INIT = ("ros2:rcl_init", (0xC0, b"4.1.0"))
Make = Callable[..., Path]


def refused(paths: list[Path], database: Path, **options: Any) -> TraceError:
    """Return the error; nothing may be left of the ingest."""
    with pytest.raises(TraceError) as raised:
        ingest(paths, database, **options)
    assert raised.value.exit_code == ExitCode.TRACE
    assert raised.value.hint
    assert os.listdir(database.parent) == []
    return raised.value


def test_a_kernel_trace_alone(make_trace: Make, new_database: Path) -> None:
    kernel = {"hostname": "robot", "domain": "kernel", "tracer_name": "lttng-modules"}
    path = make_trace({"sched_switch": {"prev_tid": "i32"}}, environment=kernel)
    error = refused([path], new_database)
    assert "only a kernel trace" in error.message
    assert "ust" in (error.hint or "")


def test_a_trace_of_something_else(make_trace: Make, new_database: Path) -> None:
    path = make_trace({"my_app:started": {"x": "i32"}}, [("my_app:started", (1,))])
    error = refused([path], new_database)
    assert "my_app:started" in error.message
    assert "LTTng" in (error.hint or "")


def test_ros_events_declared_but_none_recorded(make_trace: Make, new_database: Path) -> None:
    path = make_trace(
        {**ROS, "my_app:started": {"x": "i32"}}, [("my_app:started", (n,)) for n in range(3)]
    )
    error = refused([path], new_database)
    assert "my_app:started (3)" in error.message


@pytest.mark.parametrize("contexts", [{}, {"vtid": "i32"}, {"vpid": "i32", "procname": "text[17]"}])
def test_a_trace_that_does_not_say_who(
    make_trace: Make, new_database: Path, contexts: dict[str, str]
) -> None:
    path = make_trace(ROS, [INIT], contexts=contexts)
    error = refused([path], new_database)
    assert "which process and thread" in error.message
    assert "lttng add-context -u -t vpid -t vtid" in (error.hint or "")


def test_a_kernel_trace_beside_that_of_ros(make_trace: Make, new_database: Path) -> None:
    """Is read along; it needs no process contexts."""
    kernel = {"hostname": "robot", "domain": "kernel"}
    first = make_trace(ROS, [INIT], name="session/ust")
    make_trace(
        {"sched_switch": {"prev_tid": "i32"}},
        [("sched_switch", (7,))],
        name="session/kernel",
        environment=kernel,
        trace_uuid=UUID(int=7),
        contexts={},
    )
    ingest([first.parent], new_database)
    with duckdb.connect(str(new_database), read_only=True) as connection:
        assert connection.execute("SELECT domain FROM trace ORDER BY 1").fetchall() == [
            ("kernel",),
            ("ust",),
        ]
        assert connection.execute("SELECT pid FROM process").fetchall() == [(100,)]


def test_paths_without_a_trace(new_database: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("no trace")
    for name in ("missing", "empty", "file"):
        refused([tmp_path / name], new_database)


def test_a_path_for_a_host_that_holds_none_of_the_traces(
    trace: Path, new_database: Path, tmp_path: Path
) -> None:
    error = refused([trace], new_database, hosts={"robot": str(tmp_path)})
    assert "host robot" in error.message


@pytest.mark.parametrize(
    ("hosts", "message"),
    [
        ({"a": "alpha", "b": "alpha"}, "two names are given for the host of one path: a and b"),
        ({"a": ".", "b": "alpha", "c": "beta"}, "other hosts have all traces below the path given"),
    ],
)
def test_a_name_of_a_host_that_would_be_lost(
    other_trace: Path, new_database: Path, hosts: dict[str, str], message: str
) -> None:
    with pytest.raises(UsageError, match=message):
        ingest(
            [other_trace],
            new_database,
            hosts={name: other_trace / path for name, path in hosts.items()},
        )
    assert not new_database.exists()


def database_refused(trace: Path, database: Path) -> DatabaseError:
    with pytest.raises(DatabaseError) as raised:
        ingest([trace], database)
    assert raised.value.exit_code == ExitCode.DATABASE
    assert raised.value.hint
    return raised.value


def test_a_foreign_database(trace: Path, new_database: Path) -> None:
    with duckdb.connect(str(new_database)) as connection:
        connection.execute("CREATE TABLE run AS SELECT 1 AS run_id")
    before = new_database.read_bytes()
    assert "not one of msgflow" in database_refused(trace, new_database).message
    assert new_database.read_bytes() == before


def test_a_file_that_is_no_database(trace: Path, new_database: Path) -> None:
    new_database.write_text("shopping list")
    database_refused(trace, new_database)
    assert new_database.read_text() == "shopping list"
    assert os.listdir(new_database.parent) == [new_database.name]


def test_a_directory_in_the_place_of_the_database(trace: Path, new_database: Path) -> None:
    new_database.mkdir()
    assert "directory" in database_refused(trace, new_database).message
    assert os.listdir(new_database.parent) == [new_database.name]


def test_a_directory_that_does_not_exist(trace: Path, tmp_path: Path) -> None:
    assert "missing" in database_refused(trace, tmp_path / "missing" / "x.duckdb").message
    assert not (tmp_path / "missing").exists()


def test_a_directory_that_cannot_be_written(trace: Path) -> None:
    """Not even by the administrator."""
    directory = Path("/proc/self")
    if not directory.is_dir():
        pytest.skip("there is no /proc here")
    assert "/proc" in database_refused(trace, directory / "x.duckdb").message


def test_a_newer_database(trace: Path, database: Path) -> None:
    with duckdb.connect(str(database)) as connection:
        connection.execute("UPDATE store.alembic_version SET version_num = '9999_more'")
    error = database_refused(trace, database)
    assert "9999" in error.message
    assert "upgrade msgflow" in (error.hint or "")


def test_a_database_with_the_views_of_another_version(trace: Path, database: Path) -> None:
    with duckdb.connect(str(database)) as connection:
        connection.execute("UPDATE store.definition SET hash = 'old' WHERE name = 'views'")
    assert f"msgflow db upgrade --db {database}" in (database_refused(trace, database).hint or "")


def test_a_database_in_use(trace: Path, database: Path) -> None:
    """Refused before anything is read."""
    holder = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import duckdb, sys, time; con = duckdb.connect(sys.argv[1]); "
            "print('open', flush=True); time.sleep(60)",
            str(database),
        ],
        stdout=subprocess.PIPE,
    )
    try:
        assert holder.stdout is not None
        with holder.stdout:
            assert holder.stdout.readline() == b"open\n"
        holder_said = (
            f"by another process (process {holder.pid}: {sys.executable} -c 'import duckdb"
        )
        assert holder_said in database_refused(trace, database).message
    finally:
        holder.kill()
        holder.wait()
    assert os.listdir(database.parent) == [database.name]
