"""`msgflow mcp`, asked by the client of the SDK over stdin and stdout, as an agent asks."""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import pytest
from mcp import Client
from mcp.client.stdio import StdioServerParameters
from support.thorough import few, thorough

from msgflow.database import Database
from msgflow.mcp import server as mcp_server

Call = tuple[str, dict[str, Any]]


@pytest.fixture
def robot_database(simulated: Callable[..., Path]) -> Path:
    """Return a database with three seconds of a robot."""
    return simulated("demo", 0.3)


def ask(database: Path, *calls: Call) -> list[tuple[bool, str]]:
    """Return for each call whether it failed, and the text of the answer."""

    async def talk() -> list[tuple[bool, str]]:
        server = StdioServerParameters(
            command=sys.executable,
            args=["-m", "msgflow", "mcp", "--db", str(database)],
            # The SDK passes on few variables.
            env=dict(os.environ),
        )
        async with Client(server) as client:
            answers = [await client.call_tool(name, words) for name, words in calls]
        return [(bool(answer.is_error), answer.content[0].text) for answer in answers]

    return asyncio.run(talk())


def ask_here(database: Path, *calls: Call) -> list[tuple[bool, str]]:
    """As `ask` does, of a server in this process."""

    async def talk() -> list[tuple[bool, str]]:
        async with Client(mcp_server.make_server(database)) as client:
            answers = [await client.call_tool(name, words) for name, words in calls]
        return [(bool(answer.is_error), answer.content[0].text) for answer in answers]

    return asyncio.run(talk())


def one(database: Path, tool: str, **words: Any) -> Any:
    ((failed, text),) = ask_here(database, (tool, words))
    assert not failed, text
    return json.loads(text)


def test_the_tools_and_what_they_answer(small_database: Path) -> None:
    before = hashlib.sha256(small_database.read_bytes()).digest()
    found = ask(
        small_database,
        ("info", {}),
        ("check", {"run": "all"}),
        ("list_queries", {}),
        ("list_queries", {"name": "e2e-latency"}),
        ("run_query", {"name": "topics", "run": "morning", "topic": ["/ch*"]}),
        ("schema", {}),
        ("schema", {"view": "run"}),
        ("sql", {"query": "SELECT name FROM run ORDER BY run_id DESC"}),
    )
    assert not any(failed for failed, _ in found), found
    info, check, queries, query, topics, views, view, sql = (json.loads(text) for _, text in found)
    assert [row["name"] for row in info["rows"]] == ["morning", "noon"]
    assert all({"cause", "cure", "severity"} <= set(row) for row in check["rows"])
    assert {"name": "e2e-latency", "title": "End-to-end latency by path"} in queries["rows"]
    assert "from" in [param["name"] for param in query["parameters"]]
    assert topics["runs"] == ["morning (1)"]
    assert [row["topic_name"] for row in topics["rows"]] == ["/chatter"]
    assert "publication" in {row["view"] for row in views["rows"]}
    assert any("labels" in row.values() for row in view["rows"])
    assert sql["rows"] == [{"name": "noon"}, {"name": "morning"}]
    assert hashlib.sha256(small_database.read_bytes()).digest() == before


def test_of_tables_of_another_version_a_tool_says_what_to_do(older_database: Path) -> None:
    ((failed, text),) = ask_here(older_database, ("info", {}))
    assert failed
    assert "not as this msgflow makes it" in text
    assert "msgflow ingest TRACE --db NEW.duckdb reads the recording again" in text


def test_a_flow_is_a_tree(small_database: Path) -> None:
    with duckdb.connect(str(small_database), read_only=True) as connection:
        number = connection.execute("SELECT min(publication_id) FROM publication").fetchall()[0][0]
    ((failed, text),) = ask_here(small_database, ("flow", {"publication_id": number}))
    assert not failed
    assert text.startswith(f"publication {number}, /chatter")


@pytest.mark.thorough
def test_why_compare_and_verify(robot_database: Path) -> None:
    why = one(robot_database, "why")
    first, *others = why["rows"]
    assert first["section"] == "verdict"
    named = {"rank", "node", "callback", "function", "kind", "harm_ns", "evidence", "next"}
    assert named | {"headline"} <= first.keys()
    assert {"paths", "nodes"} <= {row["section"] for row in others}
    compared = one(robot_database, "compare", window=["0s..1s", "1s..2s"], what="topics")
    assert {"a_median_ns", "b_median_ns"} <= set(compared["rows"][0])
    windows = ["0s..2s", "2s..7s"]
    with Database(robot_database) as database:
        lines = database.compare(run=1, window=windows).lines
    assert lines
    said = one(robot_database, "compare", run="1", window=windows)["notes"]
    assert said[: len(lines)] == list(lines)
    topic = one(robot_database, "run_query", name="topics")["rows"][0]["topic_name"]
    requirements = f"targets:\n  - topic: {topic}\n    rate: '< 1000 Hz'\n"
    verified = one(robot_database, "verify", requirements=requirements)
    assert [row["verdict"] for row in verified["rows"]] == ["passed"]
    ((failed, text),) = ask_here(robot_database, ("verify", {"requirements": "targets: 1"}))
    assert failed
    assert "hint: " in text


def test_answers_are_capped_and_say_so(small_database: Path) -> None:
    few = one(small_database, "sql", query="FROM range(5)", limit=2)
    assert [row["range"] for row in few["rows"]] == [0, 1]
    assert "only the first 2 rows" in few["notes"][0]
    most = one(small_database, "sql", query="FROM range(9999)", limit=10**9)
    assert len(most["rows"]) == mcp_server.MOST_ROWS
    wide = one(small_database, "sql", query="SELECT repeat('x', 3000) AS x FROM range(20)")
    assert len(json.dumps(wide)) < mcp_server.MOST_CHARACTERS + 1_000
    assert len(wide["rows"]) == 9
    assert "only 9 of these 20 rows have room in 20,000 characters" in wide["notes"][-1]
    rows = one(small_database, "run_query", name="topics", internal=True, limit=1)
    assert len(rows["rows"]) == 1
    assert "only the first 1 of" in rows["notes"][-1]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (("sql", {"query": "COPY run TO 'x.csv'"}), ["not a statement that only reads", "hint: "]),
        thorough(
            ("sql", {"query": "FROM read_csv('/etc/passwd')"}), ["SQL reaches no other files"]
        ),
        thorough(("sql", {"query": "FROM '/etc/passwd'"}), ["/etc/passwd does not exist"]),
        thorough(("sql", {"query": "FROM nothing"}), ["nothing"]),
        (("run_query", {"name": "latency"}), ["no such query", "hint: ", "e2e-latency"]),
        thorough(("run_query", {"name": "info", "run": "x"}), ["no such run — x", "morning (1)"]),
        (
            ("run_query", {"name": "e2e-latency", "parameters": {"paths": "/etc/passwd"}}),
            ["e2e-latency has no such parameter — paths"],
        ),
        thorough(("schema", {"view": "x"}), ["there is no such view — x"]),
        thorough(("flow", {"topic": "/nothing"}), ["/nothing"]),
        thorough(("check", {"run": "x"}), ["no such run — x"]),
    ],
)
def test_errors_have_hints(small_database: Path, call: Call, words: list[str]) -> None:
    ((failed, text),) = ask_here(small_database, call)
    assert failed
    for word in words:
        assert word in text


@pytest.mark.parametrize(
    ("tool", "given", "hint"),
    [
        ("info", {"run": "1"}, "it has none: call it without"),
        ("check", {"limit": 1}, "it has run"),
        ("list_queries", {"query": "x"}, "it has name"),
        (
            "run_query",
            {"name": "e2e-latency", "to": "/echo", "run": "1"},
            'put what is the query\'s own into parameters: {"to": "/echo"}',
        ),
        (
            "run_query",
            {"name": "e2e-latency", "topics": ["/x"]},
            "in parameters, e2e-latency takes",
        ),
        ("run_query", {"name": "no-query", "to": "/echo"}, "it has name, parameters, run"),
        ("schema", {"name": "run"}, "it has view"),
        ("sql", {"query": "SELECT 1", "run": "1"}, "it has query, limit"),
        ("flow", {"topic": "/chatter", "node": "/x"}, "it has topic, at, publication_id"),
    ],
)
def test_arguments_that_a_tool_does_not_have_are_refused(
    small_database: Path, tool: str, given: dict[str, Any], hint: str
) -> None:
    ((failed, text),) = ask_here(small_database, (tool, given))
    assert failed
    assert f"{tool} has no such argument — " in text
    assert f"hint: {hint}" in text or f"; {hint}" in text


def test_the_schemas_say_that_nothing_else_is_taken(small_database: Path) -> None:
    async def talk() -> Any:
        async with Client(mcp_server.make_server(small_database)) as client:
            return await client.list_tools()

    tools = asyncio.run(talk()).tools
    assert len(tools) == 11
    assert all(tool.input_schema["additionalProperties"] is False for tool in tools)


@pytest.mark.thorough
def test_without_a_database_a_call_says_so(tmp_path: Path) -> None:
    ((failed, text),) = ask(tmp_path / "none.duckdb", ("info", {}))
    assert failed
    assert "no database" in text
    assert "hint: msgflow ingest TRACE" in text
    assert not (tmp_path / "none.duckdb").exists()


@pytest.mark.thorough
def test_a_call_that_takes_too_long_is_stopped(small_database: Path) -> None:
    async def talk() -> Any:
        async with Client(mcp_server.make_server(small_database, seconds=3)) as client:
            text = "SELECT sum(a.range * b.range) FROM range(10000000) AS a, range(10000000) AS b"
            late = await client.call_tool("sql", {"query": text})
            after = await client.call_tool("sql", {"query": "SELECT 1 AS one"})
            return late, after

    late, after = asyncio.run(talk())
    assert late.is_error
    assert "it took longer than 3 s\nhint: read one run" in late.content[0].text
    assert not after.is_error


@pytest.mark.thorough
def test_a_waiting_agent_keeps_nobody_from_writing(small_database: Path) -> None:
    async def talk() -> None:
        async with Client(mcp_server.make_server(small_database)) as client:
            await client.call_tool("info", {})
            program = [sys.executable, "-m", "msgflow", "runs", "rename", "morning", "dawn"]
            subprocess.run([*program, "--db", str(small_database)], check=True)
            found = await client.call_tool("info", {})
            assert "dawn" in found.content[0].text

    asyncio.run(talk())


def test_without_the_extra_it_says_what_to_install(small_database: Path) -> None:
    code = (
        "import sys; sys.modules['mcp'] = None; sys.argv = ['msgflow', 'mcp']\n"
        "from msgflow.__main__ import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == (
        "error: the SDK of the Model Context Protocol is not installed\n\n"
        f"hint: {sys.executable} -m pip install mcp\n"
    )


def test_long_cells_are_cut_and_leave_room_for_the_others(small_database: Path) -> None:
    query = "SELECT repeat('x', 90000) AS x, range(9000) AS numbers, 7 AS short FROM range(3)"
    found = one(small_database, "sql", query=query)
    assert [row["short"] for row in found["rows"]] == [7, 7, 7]
    most = mcp_server.MOST_IN_CELL
    assert found["rows"][0]["x"] == "x" * most + "… (90,000 characters)"
    assert found["rows"][0]["numbers"].endswith(" characters)")
    assert len(found["rows"][0]["numbers"]) < most + 30


def test_what_takes_too_much_memory_says_so(
    small_database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mcp_server, "MEMORY_LIMIT", "20MB")
    server = mcp_server.make_server(small_database)

    async def call() -> Any:
        async with Client(server) as client:
            query = "SELECT list(range) FROM range(30000000)"
            return await client.call_tool("sql", {"query": query})

    answer = asyncio.run(call())
    assert answer.is_error
    assert "more memory than 20MB\nhint: " in answer.content[0].text


@pytest.mark.thorough
@pytest.mark.parametrize("number", few([signal.SIGINT, signal.SIGTERM], signal.SIGTERM))
def test_a_signal_ends_it_while_it_waits(small_database: Path, number: int) -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "msgflow", "mcp", "--db", str(small_database)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        server.stdin.write(b'{"jsonrpc": "2.0", "id": 1, "method": "ping"}\n')
        server.stdin.flush()
        assert server.stdout.readline()
        server.send_signal(number)
        try:
            assert server.wait(10) == -number
        finally:
            server.kill()


def test_names_of_a_stranger_make_no_long_answers(small_database: Path, tmp_path: Path) -> None:
    forged = tmp_path / "forged.duckdb"
    forged.write_bytes(small_database.read_bytes())
    with duckdb.connect(str(forged)) as con:
        con.execute("UPDATE store.run SET name = repeat('n', 100_000)")
        con.execute(
            "INSERT INTO store.finding (run_id, name, subject, count)"
            " SELECT run_id, 'lost_packets', repeat('s', 30_000), 1 FROM store.run"
        )
    long = "q" * 100_000
    answers = ask_here(forged, ("info", {}), ("check", {}), ("run_query", {"name": long}))
    assert [failed for failed, _ in answers] == [False, False, True]
    assert all(len(text) < 1.5 * mcp_server.MOST_CHARACTERS for _, text in answers)
    # One that is long does not hide the others.
    assert json.loads(answers[1][1])["rows"]


def test_half_a_character_is_refused_in_words(small_database: Path) -> None:
    for call in (("sql", {"query": "\ud800"}), ("schema", {"view": "\udcff"})):
        assert ask_here(small_database, call)[0][1].startswith("an argument has half of a char")
