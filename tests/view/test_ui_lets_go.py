"""`msgflow ui` lets go of its database, opens it again, and keeps its token."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import duckdb
import pytest
from support.served import Served
from support.tables import decoded

from msgflow.db.sandbox import opening
from msgflow.errors import DatabaseInUseError
from msgflow.view import pages
from msgflow.view.kept_token import kept_token
from msgflow.view.page_query import Question
from msgflow.view.pages import Pages
from msgflow.view.shared_database import SharedDatabase, UnopenedError

HOLD = (
    "import duckdb, sys; con = duckdb.connect(sys.argv[1]); print('held', flush=True);"
    " sys.stdin.read()"
)


@pytest.fixture
def database(simulated: Callable[..., Path], tmp_path: Path) -> Path:
    return Path(shutil.copyfile(simulated("pipeline", 0.1), tmp_path / "run.duckdb"))


@contextmanager
def served(path: Path) -> Iterator[Served]:
    server = Served(path)
    try:
        yield server
    finally:
        server.close()


def msgflow(*words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a command in a process of its own: one process shares what it has open."""
    return subprocess.run(
        [sys.executable, "-m", "msgflow", *words],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


def is_let_go(path: Path) -> bool:
    try:
        duckdb.connect(str(path), config={"threads": 1}).close()
    except duckdb.Error:  # this process has it open, with other settings
        return False
    return True


def wait_until_let_go(path: Path) -> None:
    end = time.monotonic() + 30
    while not is_let_go(path):
        assert time.monotonic() < end
        time.sleep(0.1)


@pytest.fixture
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("msgflow.view.shared_database.SECONDS_UNTIL_FREE", 0.2)


@pytest.mark.usefixtures("_soon")
def test_an_ingest_into_a_database_whose_pages_are_idle(dropping: Path, database: Path) -> None:
    with served(database) as server:
        before = server.generation()
        assert len(decoded(server.get("/api/run", X_Generation=before)[2]).rows) == 1
        wait_until_let_go(database)
        done = msgflow("ingest", dropping.parent / "trace", "--name", "new", "--db", database)
        assert done.returncode == 0, done.stderr
        status, _, content = server.get("/api/run", X_Generation=before)
        assert status == 409
        assert "was changed while the page was open" in json.loads(content)["error"]
        after = server.generation()
        status, _, content = server.get("/api/run", X_Generation=after)
        assert (status, len(decoded(content).rows)) == (200, 2)


@pytest.mark.thorough
@pytest.mark.usefixtures("_soon")
def test_answers_are_kept_while_it_is_closed(
    database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted: list[int] = []

    def count(_: Pages, asked: Question) -> bytes:
        counted.append(1)
        return bytes(1)

    monkeypatch.setitem(pages.ANSWERS, "count", count)
    with served(database) as server:
        generation = server.generation()
        for _ in range(2):
            assert server.get("/api/count", X_Generation=generation)[::2] == (200, bytes(1))
            wait_until_let_go(database)
    assert len(counted) == 1


@pytest.mark.thorough
@pytest.mark.usefixtures("_soon")
def test_it_is_kept_while_a_question_runs(database: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    is_asked, may_end = threading.Event(), threading.Event()

    def wait(_: Pages, asked: Question) -> bytes:
        is_asked.set()
        assert may_end.wait(60)
        return bytes(asked.connection.execute("SELECT 7").fetchall()[0][0])

    monkeypatch.setitem(pages.ANSWERS, "wait", wait)
    with served(database) as server:
        answers: list[tuple[int, dict[str, str], bytes]] = []
        asking = threading.Thread(target=lambda: answers.append(server.get("/api/wait")))
        asking.start()
        assert is_asked.wait(30)
        refused = msgflow("runs", "rename", "1", "other", "--db", database)
        may_end.set()
        asking.join(30)
        assert refused.returncode == 4
        assert f"in use by another process (process {os.getpid()}: " in refused.stderr
        assert answers[0][0] == 200
        assert answers[0][2] == bytes(7)


@pytest.mark.usefixtures("_soon")
def test_who_has_the_database_is_said_until_it_ends(database: Path) -> None:
    with served(database) as server:
        before = server.generation()
        wait_until_let_go(database)
        with subprocess.Popen(
            [sys.executable, "-c", HOLD, database], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        ) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == b"held\n"
            status, _, content = server.get("/api/run", X_Generation=before)
            assert server.generation() == ""
            process.communicate()
        said = json.loads(content)
        assert (status, said["code"]) == (503, "unopened")
        assert (
            f"in use by another process (process {process.pid}: {sys.executable}" in said["error"]
        )
        assert said["hint"] == "wait until it has ended, then reload the page"
        assert server.get("/api/run", X_Generation=server.generation())[0] == 200


def test_a_command_that_is_refused_learns_that_the_pages_let_go(
    database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    holder = " (process 7: python -m msgflow ui)"
    monkeypatch.setattr("msgflow.db.sandbox.lock_holder", lambda path: holder)
    with pytest.raises(DatabaseInUseError) as refused, opening(database):
        raise duckdb.IOException("Could not set lock on file")
    assert "msgflow ui lets go of it" in str(refused.value.hint)


@pytest.mark.thorough
def test_the_token_is_that_of_the_database(database: Path, tmp_path: Path) -> None:
    with served(database) as first:
        cookie = first.token
    with served(database) as second:
        assert second.token == cookie
        generation = second.generation()
        assert second.get("/api/run", X_Generation=generation)[0] == 200
    with served(database) as third:  # a page that was open meanwhile goes on
        assert third.get("/api/run", X_Generation=generation)[0] == 200
    link = tmp_path / "link.duckdb"
    link.symlink_to(database)
    with served(link) as same:
        assert same.token == cookie
    other = Path(shutil.copyfile(database, tmp_path / "other.duckdb"))
    with served(other) as another:
        assert another.token != cookie


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state" / "msgflow"


def test_the_user_alone_can_read_a_token(state: Path) -> None:
    token = kept_token("/a")
    (file,) = state.iterdir()
    assert (file.stat().st_mode & 0o777, state.stat().st_mode & 0o777) == (0o600, 0o700)
    assert file.read_text() == token
    assert len(token) == 32
    assert kept_token("/a") == token
    assert kept_token("/b") != token


@pytest.mark.parametrize("harm", ["readable", "link", "pipe", "damaged"])
def test_a_token_that_others_may_know_is_replaced(state: Path, harm: str) -> None:
    token = kept_token("/a")
    (file,) = state.iterdir()
    if harm == "readable":
        file.chmod(0o640)
    elif harm == "link":
        file.rename(state.parent / "elsewhere")
        file.symlink_to(state.parent / "elsewhere")
    elif harm == "pipe":
        file.unlink()
        os.mkfifo(file, 0o600)
    else:
        file.write_text("short")
    assert kept_token("/a") not in (token, "short")
    assert file.is_file()
    assert not file.is_symlink()
    assert file.stat().st_mode & 0o777 == 0o600
    assert kept_token("/a") == file.read_text()


def test_where_nothing_can_be_kept_a_token_is_new(state: Path) -> None:
    state.parent.write_text("no directory")
    assert len(kept_token("/a")) == 32
    assert kept_token("/a") != kept_token("/a")


def test_a_question_that_no_interrupt_ends_keeps_nothing_open_for_ever(
    small_database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, ended = threading.Event(), threading.Event()

    def answer(*_: object) -> bytes:
        ended.wait(60)
        return b""

    monkeypatch.setattr(Pages, "answer", answer)
    monkeypatch.setattr("msgflow.view.shared_database._MOST_SECONDS_TO_END", 0.2)
    shared = SharedDatabase(small_database, None)
    with ThreadPoolExecutor(1) as beside:
        asked = beside.submit(shared.answer, "run", {}, None, lambda _: begun.set())
        begun.wait(60)
        begin = time.monotonic()
        os.utime(small_database)
        with pytest.raises(UnopenedError, match="does not end"):
            shared.generation()
        shared.close()
        assert time.monotonic() - begin < 30
        assert not asked.done()
        ended.set()
