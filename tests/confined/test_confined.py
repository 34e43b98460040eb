"""Queries of users in a child process: its bounds, and its end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import duckdb
import pytest
from support.processes import children_of, has_ended

from msgflow.cli.sql_process import MOST_BYTES, WarmSql
from msgflow.confined.process import ConfinedProcess, LateError
from msgflow.db.memory import default_limit
from msgflow.errors import DatabaseError, QueryError, UsageError

SLOW = "SELECT levenshtein(repeat('a', 400000), repeat('b', 400000))"
ASKING = """
import sys; from msgflow.cli.sql_process import WarmSql
WarmSql(sys.argv[1], memory_limit=None, seconds=100)(sys.argv[2], 1)
"""
LARGE = "SELECT list_sum(range(700000000))"


@pytest.fixture
def sql(small_database: Path) -> Iterator[WarmSql]:
    with closing(WarmSql(small_database, memory_limit=None, seconds=30)) as warm:
        yield warm


def test_rows_and_notes_come_back(sql: WarmSql) -> None:
    found = sql("SELECT run_id FROM run ORDER BY ALL", 1)
    assert found.table.to_pylist() == [{"run_id": 1}]
    assert found.notes == ["only the first 1 rows are shown; --limit raises that"]


@pytest.mark.parametrize(
    ("kind", "text"), [(QueryError, "DELETE FROM run"), (UsageError, ""), (QueryError, "SELECT x")]
)
def test_errors_come_back(sql: WarmSql, kind: type[Exception], text: str) -> None:
    with pytest.raises(kind) as raised:
        sql(text, 1)
    assert type(raised.value) is kind


def test_a_missing_database(tmp_path: Path) -> None:
    with (
        closing(WarmSql(tmp_path / "x.duckdb", memory_limit=None, seconds=30)) as sql,
        pytest.raises(DatabaseError, match="no database"),
    ):
        sql("SELECT 1", 1)


@pytest.mark.thorough
def test_an_answer_is_cut_by_bytes(sql: WarmSql) -> None:
    """Of 300 rows of 1 MB each; the first row alone is of half that size."""
    text = "SELECT repeat('x', if(i = 0, 500_000, 1_000_000)) AS x FROM range(300) t(i) ORDER BY i"
    found = sql(text, 1000)
    assert 90_000_000 < found.table.nbytes <= MOST_BYTES
    (note,) = found.notes
    assert note == f"the first {len(found)} of 300 rows: all take 300 MB, and a page shows 100 MB"


def test_without_a_limit_it_is_that_of_a_server(sql: WarmSql) -> None:
    found = sql("SELECT current_setting('memory_limit') AS said", 1).table.to_pylist()
    with duckdb.connect() as con:
        con.execute("SET memory_limit = ?", [default_limit()])
        expected = con.execute("SELECT current_setting('memory_limit')").fetchall()
    assert [(row["said"],) for row in found] == expected


def test_functions_of_duckdb_keep_to_the_memory(small_database: Path) -> None:
    with (
        closing(WarmSql(small_database, memory_limit="200MB", seconds=100)) as sql,
        pytest.raises(QueryError, match="more memory is needed"),
    ):
        sql(LARGE, 1)


def test_a_late_call_is_killed_and_the_next_one_works(small_database: Path) -> None:
    asked = {"path": str(small_database), "memory_limit": None, "limit": None}
    with ConfinedProcess("msgflow.cli.sql_process", seconds=2) as process:
        begin = time.monotonic()
        with pytest.raises(LateError, match="longer than 2 s"):
            process.call("answer", asked | {"text": SLOW})
        assert time.monotonic() - begin < 60
        assert b"one" in process.call("answer", asked | {"text": "SELECT 1 AS one"})


def test_one_child_answers_query_after_query(small_database: Path) -> None:
    before = set(children_of(os.getpid()))
    with closing(WarmSql(small_database, memory_limit=None, seconds=30)) as sql:
        assert set(children_of(os.getpid())) == before
        assert sql("SELECT 1 AS one", 10).table.to_pylist() == [{"one": 1}]
        (child,) = set(children_of(os.getpid())) - before
        with pytest.raises(QueryError, match="LINE 1"):
            sql("SELECT nothing", 10)
        assert len(sql("FROM range(11)", 10)) == 10
        assert set(children_of(os.getpid())) - before == {child}
        # It has nothing open.
        duckdb.connect(str(small_database)).close()
    assert has_ended(child)


def test_another_thread_ends_a_query_and_the_next_one_works(small_database: Path) -> None:
    with (
        closing(WarmSql(small_database, memory_limit=None, seconds=100)) as sql,
        ThreadPoolExecutor(1) as pool,
    ):
        sql("SELECT 1", 10)
        slow = pool.submit(sql, SLOW, 10)
        time.sleep(0.5)
        sql.interrupt()
        with pytest.raises(QueryError, match="has ended"):
            slow.result(20)
        assert len(sql("SELECT 1", 10)) == 1


@pytest.mark.thorough
def test_a_child_killed_before_it_begins_fails_no_call(small_database: Path) -> None:
    asked = {"path": str(small_database), "memory_limit": None, "limit": None}
    before = set(children_of(os.getpid()))
    with ConfinedProcess("msgflow.cli.sql_process") as process, ThreadPoolExecutor(1) as pool:
        process.call("answer", asked | {"text": "SELECT 1 AS one"})
        (child,) = set(children_of(os.getpid())) - before
        os.kill(child, signal.SIGSTOP)
        answer = pool.submit(process.call, "answer", asked | {"text": "SELECT 2 AS two"})
        time.sleep(0.5)  # the call waits
        os.kill(child, signal.SIGKILL)
        assert b"two" in answer.result(60)


def test_a_call_that_begins_to_run_is_not_repeated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "counting.py").write_text(
        "import os\ndef end(write): open(os.environ['COUNT'], 'a').write('x'); os._exit(3)\n"
    )
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    monkeypatch.setenv("COUNT", str(tmp_path / "count"))
    with ConfinedProcess("counting") as process, pytest.raises(QueryError):
        process.call("end", {})
    assert (tmp_path / "count").read_text() == "x"


def test_a_mistake_in_the_child_is_no_error_of_the_user() -> None:
    with (
        ConfinedProcess("msgflow.cli.sql_process") as process,
        pytest.raises(RuntimeError, match="no attribute 'nothing'"),
    ):
        process.call("nothing", {})


@pytest.mark.thorough
def test_a_child_that_ends_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ending.py").write_text(
        "import os\ndef end(write): os._exit(3)\ndef stop(write): os.abort()\n"
    )
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    with ConfinedProcess("ending") as process:
        with pytest.raises(QueryError, match=r"has ended \(exit code 3\)"):
            process.call("end", {})
        with pytest.raises(QueryError, match=r"has ended \(SIGABRT\)"):
            process.call("stop", {})
        with pytest.raises(RuntimeError, match=r"^TypeError: .*argument"):
            process.call("end", {"x": 1})
    with (
        ConfinedProcess("no_such_module") as process,
        pytest.raises(QueryError, match="cannot start"),
    ):
        process.call("x", {})


def test_the_child_ends_with_its_parent(small_database: Path) -> None:
    parent = subprocess.Popen(
        [sys.executable, "-c", ASKING, str(small_database), SLOW],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    end = time.monotonic() + 30
    while not (found := children_of(parent.pid)) and time.monotonic() < end:
        time.sleep(0.05)
    time.sleep(1)
    parent.kill()
    parent.wait()
    assert found
    assert has_ended(found[0])


def test_nothing_is_imported_from_the_current_folder(
    sql: WarmSql, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    for name in ("duckdb", "queue", "msgflow"):
        (folder / f"{name}.py").write_text(f"open({str(tmp_path / 'run')!r}, 'a')\n")
    monkeypatch.chdir(folder)
    assert len(sql("SELECT 1", 1)) == 1
    assert not os.path.exists(tmp_path / "run")
