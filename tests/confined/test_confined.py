"""Queries of users in a child process: its bounds, and its end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import duckdb
import pytest
from processes import children_of, has_ended

from msgflow.confined.process import ConfinedProcess, LateError
from msgflow.confined.query import WarmSql, confined_query, confined_sql
from msgflow.errors import DatabaseError, QueryError, UsageError

SLOW = "SELECT levenshtein(repeat('a', 400000), repeat('b', 400000))"
LARGE = "SELECT list_sum(range(700000000))"


def test_rows_runs_and_notes_come_back(small_database: Path) -> None:
    found = confined_sql(
        small_database, "SELECT run_id FROM run ORDER BY ALL", limit=1, memory_limit=None
    )
    assert found.table.to_pylist() == [{"run_id": 1}]
    assert found.notes == ["only the first 1 rows are shown; --limit raises that"]
    topics = confined_query(
        small_database, "topics", {"run": "morning", "where": "true"}, memory_limit=None
    )
    assert [run.title for run in topics.runs] == ["morning (1)"]
    assert topics.header is not None
    assert topics.header.name == "topics"
    assert len(topics) == 1


@pytest.mark.parametrize(
    ("kind", "text"), [(QueryError, "DELETE FROM run"), (UsageError, ""), (QueryError, "SELECT x")]
)
def test_errors_come_back(small_database: Path, kind: type[Exception], text: str) -> None:
    with pytest.raises(kind) as raised:
        confined_sql(small_database, text, limit=None, memory_limit=None)
    assert type(raised.value) is kind


def test_a_missing_database(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="no database"):
        confined_sql(tmp_path / "x.duckdb", "SELECT 1", limit=None, memory_limit=None)


def test_functions_of_duckdb_keep_to_the_memory(small_database: Path) -> None:
    with pytest.raises(QueryError, match="more memory is needed"):
        confined_sql(small_database, LARGE, limit=None, memory_limit="200MB")
    with pytest.raises(QueryError, match="more memory is needed"):
        confined_query(
            small_database,
            "info",
            {"where": "list_sum(range(700000000)) > 0"},
            memory_limit="200MB",
        )


def test_a_late_call_is_killed_and_the_next_one_works(small_database: Path) -> None:
    asked = {"method": "sql", "path": str(small_database), "memory_limit": None, "named": {}}
    with ConfinedProcess("msgflow.confined.query", seconds=4) as process:
        begin = time.monotonic()
        with pytest.raises(LateError, match="longer than 4 s"):
            process.call("answer", asked | {"given": [SLOW]})
        assert time.monotonic() - begin < 60
        assert b"one" in process.call("answer", asked | {"given": ["SELECT 1 AS one"]})


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


def test_a_child_killed_before_it_begins_fails_no_call(small_database: Path) -> None:
    asked = {"method": "sql", "path": str(small_database), "memory_limit": None, "named": {}}
    before = set(children_of(os.getpid()))
    with ConfinedProcess("msgflow.confined.query") as process, ThreadPoolExecutor(1) as pool:
        process.call("answer", asked | {"given": ["SELECT 1 AS one"]})
        (child,) = set(children_of(os.getpid())) - before
        os.kill(child, signal.SIGSTOP)
        answer = pool.submit(process.call, "answer", asked | {"given": ["SELECT 2 AS two"]})
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
        ConfinedProcess("msgflow.confined.query") as process,
        pytest.raises(RuntimeError, match="no attribute 'nothing'"),
    ):
        process.call("nothing", {})


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
        [sys.executable, "-m", "msgflow", "sql", SLOW, "--db", str(small_database)],
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
    small_database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    for name in ("duckdb", "queue", "msgflow"):
        (folder / f"{name}.py").write_text(f"open({str(tmp_path / 'run')!r}, 'a')\n")
    monkeypatch.chdir(folder)
    assert len(confined_sql(small_database, "SELECT 1", limit=None, memory_limit=None)) == 1
    assert not os.path.exists(tmp_path / "run")
