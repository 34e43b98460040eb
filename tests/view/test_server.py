"""Who gets an answer from `msgflow ui`, and what it says when it cannot."""

from __future__ import annotations

import asyncio
import http.client
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.served import Served
from support.tables import decoded
from support.thorough import few
from typer.testing import CliRunner

from msgflow.cli.app import app
from msgflow.cli.sql_process import WarmSql
from msgflow.errors import QueryError, UsageError
from msgflow.view import pages
from msgflow.view.connection import timed
from msgflow.view.page_query import Question
from msgflow.view.pages import Pages
from msgflow.view.server import is_local, listen, serving
from msgflow.view.shared_database import Turns

Serve = Callable[[Path], Served]


@pytest.mark.parametrize(
    ("host", "is_ours"),
    [
        ("127.0.0.1:8642", True),
        ("localhost:1234", True),
        ("LOCALHOST", True),
        ("127.8.8.8", True),
        ("[::1]:80", True),
        ("evil.example", False),
        ("127.0.0.1.evil.example", False),
        ("localhost.evil.example:8642", False),
        ("10.0.0.1", False),
        ("", False),
        ("127.0.0.1:8642@evil", False),
        ("127.0.0.1:99999", False),
        ("localhost:99999", False),
        ("[127.0.0.1]", False),
    ],
)
def test_only_this_machine_is_meant(host: str, is_ours: bool) -> None:
    assert is_local(host) is is_ours


def test_strangers_get_nothing(demo: Path, serve: Serve) -> None:
    server = serve(demo)
    assert server.get("/")[0] == 200
    for path in ("/", "/app.js", "/api/run"):
        assert server.get(path, Cookie="", X_Token="")[0] == 403
        wrong = {"Cookie": f"msgflow_{server.port}={server.token}", "X_Token": "wrong"}
        assert server.get(path, **wrong)[0] == 403
        assert server.get(path, Host="evil.example")[0] == 421
        assert server.get(path, Sec_Fetch_Site="cross-site")[0] == 403
        assert server.get(path, method="POST")[0] == 405
    assert server.get("/?token=wrong", Cookie="")[0] == 403
    status, headers, _ = server.get(f"/?token={server.token}", Cookie="", X_Token="")
    assert status == 200
    # The browser sends it to every port of this machine: it opens no data.
    cookie, *attributes = headers["set-cookie"].split("; ")
    assert attributes == ["HttpOnly", "Path=/", "SameSite=strict"]
    assert server.token not in cookie
    assert server.get("/", Cookie=cookie, X_Token="")[0] == 200
    assert server.get("/api/run", Cookie=cookie, X_Token="")[0] == 403
    assert server.get("/api/run", Cookie=cookie, X_Token=cookie.partition("=")[2])[0] == 403
    # Behind ssh -L the port is another one.
    other = cookie.replace(str(server.port), "9999")
    assert server.get("/", Host="localhost:9999", Cookie=other)[0] == 200


@pytest.mark.thorough
def test_a_request_that_does_not_arrive_ends(
    demo: Path, serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("msgflow.view.connection.SECONDS_FOR_A_REQUEST", 0.5)
    server = serve(demo)
    for sent in (b"", b"GET / HTTP/1.1\r\nHost: x\r\n"):
        with socket.create_connection(("127.0.0.1", server.port), timeout=20) as silent:
            silent.sendall(sent)
            assert silent.recv(1) == b""
    kept = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    for _ in range(2):
        kept.request("GET", f"/?token={server.token}")
        assert kept.getresponse().read()
    kept.sock.sendall(b"GET")
    assert kept.sock.recv(1) == b""
    kept.close()
    # The body of a refused request arrives in pieces.
    with socket.create_connection(("127.0.0.1", server.port), timeout=20) as slow:
        slow.sendall(b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n")
        assert slow.recv(1)
        slow.sendall(b"x")
        while slow.recv(4096):
            pass


def test_an_answer_may_take_longer_than_a_request(
    demo: Path, serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("msgflow.view.connection.SECONDS_FOR_A_REQUEST", 0.5)

    def slow(*_: Any) -> bytes:
        time.sleep(1.5)
        return b"answer"

    monkeypatch.setitem(pages.ANSWERS, "links", slow)
    # The connection is still known if the request names another client.
    assert serve(demo).get("/api/links", X_Forwarded_For="1.2.3.4")[2] == b"answer"


def test_no_question_is_asked_for_a_connection_that_is_closed() -> None:
    async def never(*_: Any) -> None:
        raise AssertionError

    scope = {"type": "http", "client": ("127.0.0.1", 1), "server": ("127.0.0.1", 2)}

    def ask() -> None:
        asyncio.run(timed(never)(scope, never, never))  # type: ignore[arg-type]

    # The browser of other tests keeps a loop in this thread.
    with ThreadPoolExecutor(1) as other:
        other.submit(ask).result()


def test_every_answer_is_strict(demo: Path, serve: Serve) -> None:
    server = serve(demo)
    for path, kind in (
        ("/", "text/html"),
        ("/app.js", "text/javascript"),
        ("/style.css", "text/css"),
    ):
        status, headers, _ = server.get(path)
        assert status == 200
        assert headers["content-type"].startswith(kind)
        assert "default-src 'none'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["cache-control"] == "no-store"
    for path in ("/server.py", "/..%2fserver.py", "/../pages.py", "/libraries.json", "/none.js"):
        assert server.get(path)[0] == 404


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("nothing", "no such data"),
        ("segments?start=x", "start is a whole number"),
        ("segments?start=99999999999999999999", "start is a whole number"),
        ("segments?run=99", "no such run"),
        ("flow?kind=run&id=1", "a flow begins with"),
        ("flow?kind=take&id=1;DROP", "id is a whole number"),
        ("query?name=../../etc", "do not show such a query"),
        ("query?name=data-quality", "do not show such a query"),
        ("compare?other=99", "no such run"),
        ("summary?part=other", "the summary has no such section"),
        ("area?part=callbacks&of=x", "sums are of a list"),
        ("area?part=callbacks&of=%5B%5D", "sums are of a list"),
        ("area?part=other&of=%5B1%5D", "there are no such sums"),
        ("path_point?path=x", "path is a whole number"),
        ("executor_share?bins=1000000000", "bins is from 1 to 2000"),
        ("rate?bins=0", "bins is from 1 to 2000"),
        ("gap?limit=-5", "limit is from 1 to 50000"),
        ("path_slowest?limit=50001", "limit is from 1 to 50000"),
    ],
)
def test_what_cannot_be_asked_is_refused(demo: Path, serve: Serve, place: str, said: str) -> None:
    status, _, content = serve(demo).get(f"/api/{place}")
    assert status == 400
    assert said in json.loads(content)["error"]


def test_a_replaced_database_is_said(demo: Path, tmp_path: Path, small_database: Path) -> None:
    path = tmp_path / "copy.duckdb"
    shutil.copyfile(demo, path)
    server = Served(path)
    try:
        before = server.generation()
        assert server.get("/api/run", X_Generation=before)[0] == 200
        small_database.replace(path)
        status, _, content = server.get("/api/run", X_Generation=before)
        assert status == 409
        assert json.loads(content)["code"] == "replaced"
        after = server.generation()
        status, _, content = server.get("/api/run", X_Generation=after)
        assert status == 200
        assert len(decoded(content).rows) == 2
        path.unlink()
        status, _, content = server.get("/api/run", X_Generation=after)
        assert status == 409
        assert "no longer there" in json.loads(content)["error"]
    finally:
        server.close()


def test_a_database_is_replaced_during_questions(
    demo: Path, small_database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_asked = threading.Event()

    def wait(_: Pages, asked: Question) -> bytes:
        is_asked.set()
        return bytes(
            asked.connection.execute("SELECT count(*) FROM range(1000000000000)").fetchall()[0][0]
        )

    path = shutil.copyfile(demo, tmp_path / "copy.duckdb")
    monkeypatch.setitem(pages.ANSWERS, "wait", wait)
    server = Served(path)
    try:
        before = server.generation()
        with ThreadPoolExecutor(2) as pool:
            waiting = [pool.submit(server.get, "/api/wait", X_Generation=before) for _ in range(2)]
            assert is_asked.wait(30)
            small_database.replace(path)
            status, _, content = server.get("/api/run", X_Generation=before)
            for answer in [(status, {}, content), *(one.result(60) for one in waiting)]:
                assert answer[0] == 409, answer
                assert json.loads(answer[2])["code"] == "replaced"
        status, _, content = server.get("/api/run", X_Generation=server.generation())
        assert status == 200
        assert len(decoded(content).rows) == 2
    finally:
        server.close()


def test_a_page_that_is_loaded_is_that_of_the_new_database(
    demo: Path, small_database: Path, tmp_path: Path
) -> None:
    path = shutil.copyfile(demo, tmp_path / "copy.duckdb")
    server = Served(path)
    try:
        small_database.replace(path)
        assert server.get("/api/run", X_Generation=server.generation())[0] == 200
    finally:
        server.close()


def test_what_cannot_be_opened_is_said_until_it_can(demo: Path, tmp_path: Path) -> None:
    path = shutil.copyfile(demo, tmp_path / "copy.duckdb")
    server = Served(path)
    try:
        before = server.generation()
        aside = path.rename(tmp_path / "aside.duckdb")
        path.write_text("no database")
        for _ in range(2):
            status, _, content = server.get("/api/run")
            assert status == 503
            assert "copy.duckdb" in json.loads(content)["error"]
        assert server.generation() == ""
        aside.rename(path)
        assert server.get("/api/run", X_Generation="")[0] == 409
        assert server.get("/api/run", X_Generation=before)[0] == 200
    finally:
        server.close()


def test_an_answer_from_a_file_that_was_written_meanwhile_is_none(
    demo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = shutil.copyfile(demo, tmp_path / "copy.duckdb")

    def write(*_: Any) -> bytes:
        os.utime(path, ns=(1, 1))
        return b"a part of each"

    monkeypatch.setitem(pages.ANSWERS, "write", write)
    server = Served(path)
    try:
        assert server.get("/api/write", X_Generation=server.generation())[0] == 409
    finally:
        server.close()


def test_a_port_in_use_is_said(demo: Path, tmp_path: Path) -> None:
    path = Path(shutil.copyfile(demo, tmp_path / "copy.duckdb"))
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        sql = WarmSql(path, memory_limit=None, seconds=1)
        said = pytest.raises(UsageError, match="cannot listen on the port")
        with said, serving(path, sql, port=port):
            pass
    with listen(None) as first, listen(None) as second:
        assert first.getsockname() != second.getsockname()
        assert first.getsockname()[0] == "127.0.0.1"


class running_program:
    """`msgflow ui` as a process of its own, with its address."""

    def __init__(self, path: Path, **environment: str) -> None:
        self._command = [sys.executable, "-m", "msgflow", "ui", "--port", "0", "--db", str(path)]
        self._environment = os.environ | environment

    def __enter__(self) -> tuple[subprocess.Popen[str], str]:
        command = [*self._command, *([] if "BROWSER" in self._environment else ["--no-browser"])]
        self.process = subprocess.Popen(
            command,
            env=self._environment,
            stderr=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stderr is not None
        return self.process, self.process.stderr.readline().strip()

    def __exit__(self, *error: Any) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.mark.parametrize(
    "number", few([signal.SIGINT, signal.SIGTERM, signal.SIGHUP], signal.SIGINT)
)
def test_a_signal_ends_it(demo: Path, number: signal.Signals) -> None:
    with running_program(demo) as (process, address):
        assert address.startswith("http://127.0.0.1:")
        process.send_signal(number)
        begin = time.monotonic()
        out, error = process.communicate(timeout=20)
        assert time.monotonic() - begin < 10
        assert out == ""
        assert "Traceback" not in error
        assert process.returncode == (130 if number == signal.SIGINT else 143)


def test_a_server_that_ends_by_itself_is_said(demo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **given: None)
    done = CliRunner().invoke(app, ["ui", "--port", "0", "--no-browser", "--db", str(demo)])
    assert done.exit_code == 1
    assert "error: the server of the pages has ended" in done.stderr


def test_without_a_browser_it_says_so(demo: Path) -> None:
    nowhere = {"BROWSER": "/nonexistent", "DISPLAY": "", "WAYLAND_DISPLAY": "", "PATH": ""}
    with running_program(demo, **nowhere) as (process, _):
        assert process.stderr is not None
        lines = [process.stderr.readline() for _ in range(2)]
        assert any("open the address yourself" in line for line in lines), lines


def test_what_nobody_waits_for_ends(
    demo: Path, serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A query that would take very long is interrupted when its reader goes away."""
    server = serve(demo)
    ended: list[float] = []

    def long(_: Pages, asked: Question) -> bytes:
        begin = time.monotonic()
        try:
            asked.connection.execute(
                "SELECT count(*) FROM range(10000000) a, range(10000000)"
            ).fetchall()
        finally:
            ended.append(time.monotonic() - begin)
        return b""

    monkeypatch.setitem(pages.ANSWERS, "flow", long)
    with socket.create_connection(("127.0.0.1", server.port)) as reader:
        reader.sendall(
            f"GET /api/flow HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n"
            f"X-Token: {server.token}\r\n\r\n".encode()
        )
        time.sleep(0.5)
    for _ in range(200):
        if ended:
            break
        time.sleep(0.05)
    assert ended
    assert server.get("/api/run")[0] == 200


def test_memory_that_others_took_is_waited_for() -> None:
    """Of questions that have memory one by one only, each is answered."""
    memory = threading.Lock()
    begun = threading.Barrier(3)
    tries: list[int] = []

    def ask() -> bytes:
        number = len(tries)
        tries.append(1)
        if number < 3:
            begun.wait()
        if not memory.acquire(blocking=False):
            raise QueryError("the query failed") from duckdb.OutOfMemoryException("no memory")
        try:
            time.sleep(0.2)
            return b"answer"
        finally:
            memory.release()

    turns = Turns()
    with ThreadPoolExecutor(3) as pool:
        answers = [pool.submit(turns.ask, ask) for _ in range(3)]
    assert [answer.result() for answer in answers] == [b"answer"] * 3
    assert len(tries) == 5


def test_what_needs_too_much_memory_alone_says_what_to_do() -> None:
    tries: list[int] = []

    def ask() -> bytes:
        tries.append(1)
        raise duckdb.OutOfMemoryException("no memory")

    with pytest.raises(QueryError) as error:
        Turns().ask(ask)
    assert "--memory-limit" in str(error.value.hint)
    assert len(tries) == 2


def test_other_failures_are_not_tried_again() -> None:
    tries: list[int] = []

    def ask() -> bytes:
        tries.append(1)
        raise QueryError("the query failed") from duckdb.BinderException("no such column")

    with pytest.raises(QueryError):
        Turns().ask(ask)
    assert len(tries) == 1
