from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path

import duckdb
import pyarrow.parquet as pq
import pytest
from support.thorough import few, thorough
from typer.testing import Result

from msgflow.db.objects import public_names
from msgflow.version import __version__

Msgflow = Callable[..., Result]
COMMANDS = (
    "ingest",
    "query",
    "sql",
    "info",
    "check",
    "events",
    "export",
    "export parquet",
    "export csv",
    "flow",
    "links",
    "links apply",
    "suggest links",
    "suggest",
    "db",
    "db upgrade",
    "db schema",
    "fleet ingest",
    "fleet remove",
)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(msgflow: Msgflow, command: str) -> None:
    result = msgflow(*command.split(), "--help")
    assert result.exit_code == 0
    assert f"Usage: msgflow {command}" in result.stdout
    assert result.stderr == ""


@pytest.mark.parametrize(
    "command",
    [
        "query callbacks --each",
        "sql 'SELECT 1'",
        thorough("check"),
        thorough("report -o page.html"),
        thorough("flow /chatter"),
        thorough("compare 1 2"),
        "export parquet -o views",
        thorough("export perfetto -o trace.pftrace"),
        thorough("export otlp -o traces.json"),
        thorough("export mcap -o run.mcap"),
        thorough("export csv -o rows"),
        "ui --no-browser",
    ],
)
def test_memory_can_be_limited(
    msgflow: Msgflow, small_database: Path, monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    words = [*shlex.split(command), "--db", small_database]
    results = []
    if command.startswith(("query", "ui")):
        results.append(msgflow(*words, "--memory-limit", "plenty"))
    monkeypatch.setenv("MSGFLOW_MEMORY_LIMIT", "plenty")
    results.append(msgflow(*words))
    for result in results:
        assert result.exit_code == 4
        assert "not an amount of memory — plenty" in result.stderr


def test_without_a_command_the_help_is_printed(msgflow: Msgflow) -> None:
    result = msgflow()
    assert result.exit_code == 0
    positions = [result.stdout.index(f"\n  {name} ") for name in ("ingest", "query", "sql", "db")]
    assert positions == sorted(positions)


def test_version(msgflow: Msgflow) -> None:
    assert msgflow("--version").stdout == f"msgflow {__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "error", "hint"),
    [
        (("qury",), "no such command 'qury'", "did you mean 'query'"),
        (("e2e-latency",), "no such command — e2e-latency", "msgflow query e2e-latency"),
        (("ingest",), "missing argument 'TRACE...'", "msgflow ingest --help"),
        (("ingest", ""), "the path of a trace is empty", "msgflow ingest TRACE"),
        (("ingest", ".", "--name", "all"), "takes for something else — 'all'", "nor a number"),
        (("ingest", ".", "--name", "12"), "takes for something else — '12'", "nor a number"),
        (("ingest", ".", "--name", ""), "takes for something else — ''", "nor a number"),
        (("ingest", "x", "--host", "robot"), "--host takes NAME=PATH — robot", "--host robot="),
        (("sql",), "give SQL, or a file with -f", "msgflow sql"),
        (("sql", "SELECT 1", "-f", "x"), "give SQL, or a file with -f", "msgflow sql"),
        (("sql", "-f", "none.sql"), "no such file or directory — none.sql", ""),
    ],
)
def test_usage_errors(msgflow: Msgflow, arguments: tuple[str, ...], error: str, hint: str) -> None:
    result = msgflow(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("error: ")
    assert error in result.stderr
    assert hint in result.stderr.partition("\n\nhint: ")[2]


def test_sql_from_argument_file_and_stdin(msgflow: Msgflow, small_database: Path) -> None:
    text = "SELECT name FROM run ORDER BY run_id"
    Path("q.sql").write_text(text)
    options = ("--db", small_database, "--format", "csv")
    expected = '"name"\n"morning"\n"noon"\n'
    assert msgflow("sql", text, *options).stdout == expected
    assert msgflow("sql", "-f", "q.sql", *options).stdout == expected
    assert msgflow("sql", "-", *options, stdin=text).stdout == expected


def test_sql_says_when_rows_are_cut(msgflow: Msgflow, small_database: Path) -> None:
    cut = msgflow("sql", "FROM range(5)", "--limit", 2, "--db", small_database, "--format", "csv")
    assert cut.stdout.splitlines() == ['"range"', "0", "1"]
    assert "only the first 2 rows" in cut.stderr
    whole = msgflow("sql", "FROM range(2000)", "--limit", 0, "--db", small_database)
    assert len(whole.stdout.splitlines()) == 2002
    assert whole.stderr == ""


def test_sql_that_fails_has_code_1(msgflow: Msgflow, small_database: Path) -> None:
    result = msgflow("sql", "SELECT * FROM publishr", "--db", small_database)
    assert result.exit_code == 1
    said, _, hint = result.stderr.partition("\n\n")
    assert said.splitlines() == [
        "error: Table with name publishr does not exist",
        "LINE 1: SELECT * FROM publishr",
        "                      ^^^^^^^^",
    ]
    assert hint.startswith("hint: ")


def test_sql_shows_addresses_as_numbers(msgflow: Msgflow, small_database: Path) -> None:
    text = "SELECT publisher_handle FROM publisher WHERE publisher_id = 2"
    shown = msgflow("sql", text, "--db", small_database)
    assert shown.stdout.splitlines()[-1] == "0xffffffffffffffff"
    exact = msgflow("sql", text, "--db", small_database, "--format", "csv")
    assert exact.stdout.splitlines()[-1] == str(2**64 - 1)


def test_info(msgflow: Msgflow, small_database: Path) -> None:
    result = msgflow("info", "--db", small_database)
    assert result.exit_code == 0
    for part in ("RUNS", "morning", "noon", "NODES", "/talker", "/chatter", "discarded_events"):
        assert part in result.stdout
    assert result.stderr == "note: topics: 1 internal row is hidden; --internal shows them\n"


def test_info_as_one_json_object(msgflow: Msgflow, small_database: Path) -> None:
    result = json.loads(msgflow("info", "--db", small_database, "--format", "json").stdout)
    assert list(result) == [
        "runs",
        "hosts",
        "processes",
        "nodes",
        "topics",
        "counts",
        "findings",
    ]
    assert [run["name"] for run in result["runs"]] == ["morning", "noon"]
    assert [process["pid"] for process in result["processes"]] == [43]
    assert result["findings"][0]["count"] == 7


@pytest.mark.thorough
def test_info_as_markdown(msgflow: Msgflow, small_database: Path) -> None:
    text = msgflow("info", "--db", small_database, "--format", "markdown", "--run", "1").stdout
    assert "## Topics\n\n| run_id | topic_name |" in text
    assert "| 1 | /chatter | 1 |" in text


def test_export(msgflow: Msgflow, small_database: Path) -> None:
    for kind in ("parquet", "csv"):
        arguments = ("export", kind, "-o", kind, "publisher", "node", "--db", small_database)
        result = msgflow(*arguments)
        assert result.exit_code == 0
        assert result.stdout == ""
        assert result.stderr == f"2 views, 5 rows written to {kind}\n"
        again = msgflow(*arguments)
        assert again.exit_code == 2
        assert "--force" in again.stderr
        assert msgflow(*arguments, "--force", "--run", "noon", "--end", "1s").exit_code == 0
    assert pq.read_table("parquet/node").to_pylist()[0]["node_id"] == 2
    assert Path("csv/node.csv").read_text().count("\n") == 2


def test_db_schema_lists_the_views_or_the_columns_of_one(
    msgflow: Msgflow, small_database: Path
) -> None:
    result = msgflow("db", "schema", "--db", small_database, "--format", "jsonl")
    views = {row["view"]: row for row in map(json.loads, result.stdout.splitlines())}
    assert {"take", "message", "callback_run"} < views.keys() < set(public_names())
    sentence = "Messages at the moment they were handed over to a subscription"
    assert views["take"]["description"] == sentence
    result = msgflow("db", "schema", "take", "--db", small_database, "--format", "jsonl")
    columns = [json.loads(line) for line in result.stdout.splitlines()]
    assert len(columns) == views["take"]["columns"]
    assert {"view", "column", "type", "description"} == set(columns[0])
    assert {row["view"] for row in columns} == {"take"}
    assert "taken_ns" in {row["column"] for row in columns}
    unknown = msgflow("db", "schema", "takes", "--db", small_database)
    assert unknown.exit_code == 2
    assert "there is no such view — takes" in unknown.stderr
    assert "did you mean take" in unknown.stderr
    # A directory is where a view stands.
    exported = msgflow("export", "parquet", "./out", "--db", small_database)
    assert exported.exit_code == 2
    assert "hint: msgflow db schema; a directory: -o ./out" in exported.stderr


@pytest.mark.thorough
def test_db_upgrade_of_a_current_database(msgflow: Msgflow, small_database: Path) -> None:
    with duckdb.connect(str(small_database)) as connection:
        connection.execute("UPDATE store.run SET derivation_hash = 'old'")
    first = msgflow("db", "upgrade", "--db", small_database)
    assert first.exit_code == 0
    assert "links derived anew for 2 runs" in first.stderr
    assert "is up to date" in msgflow("db", "upgrade", "--db", small_database).stderr


@pytest.mark.thorough
def test_db_upgrade_of_old_views(msgflow: Msgflow, small_database: Path) -> None:
    with duckdb.connect(str(small_database)) as connection:
        connection.execute("UPDATE store.definition SET hash = 'old' WHERE name = 'views'")
    copy = small_database.with_name("my robot.duckdb")
    copy.write_bytes(small_database.read_bytes())
    refused = msgflow("info", "--db", copy)
    assert refused.exit_code == 4
    assert refused.stderr.endswith(f"\n\nhint: msgflow db upgrade --db '{copy}'\n")
    assert msgflow("db", "upgrade", "--db", small_database).exit_code == 0
    assert msgflow("info", "--db", small_database).exit_code == 0


@pytest.mark.parametrize("command", few(["info", "info --section runs", "db upgrade"], "info"))
def test_a_database_from_before_the_first_release(
    msgflow: Msgflow, small_database: Path, command: str
) -> None:
    with duckdb.connect(str(small_database)) as connection:
        connection.execute("UPDATE store.alembic_version SET version_num = '0011'")
    refused = msgflow(*command.split(), "--db", small_database)
    assert refused.exit_code == 4
    assert f"schema revision 0011, from before the first release — {small_database}" in (
        refused.stderr
    )
    hint = "msgflow ingest TRACE --db NEW.duckdb reads the recording again"
    assert refused.stderr.endswith(f"\n\nhint: {hint}\n")


@pytest.mark.parametrize(
    "command",
    [
        "info",
        "info --section runs",
        "flow /chatter",
        "sql FROM\u00a0run",
        "check --detail",
        "db schema",
        "db upgrade",
        "export parquet -o out",
        "export csv -o out",
        "ui --no-browser",
    ],
)
def test_a_missing_database_has_code_4(msgflow: Msgflow, command: str) -> None:
    arguments = [part.replace("\u00a0", " ") for part in command.split(" ")]
    result = msgflow(*arguments)
    assert result.exit_code == 4
    assert result.stdout == ""
    assert "msgflow.duckdb" in result.stderr
    assert not Path("msgflow.duckdb").exists()
    assert not Path("out").exists()


def test_foreign_files_have_code_4(msgflow: Msgflow) -> None:
    Path("text.duckdb").write_text("no database")
    with duckdb.connect("other.duckdb") as connection:
        connection.execute("CREATE TABLE t AS SELECT 1 AS a")
    for name in ("text.duckdb", "other.duckdb"):
        result = msgflow("info", "--db", name)
        assert result.exit_code == 4
        assert name in result.stderr


def test_a_trace_that_is_not_there_has_code_3(msgflow: Msgflow) -> None:
    result = msgflow("ingest", "nowhere")
    assert result.exit_code == 3
    assert "nowhere" in result.stderr
    assert not Path("msgflow.duckdb").exists()


@pytest.mark.thorough
def test_a_report_goes_to_stdout(msgflow: Msgflow, small_database: Path) -> None:
    result = msgflow("report", "-o", "-", "--db", small_database)
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("<!DOCTYPE html>")
    assert result.stdout.rstrip().endswith("</html>")
    assert "written" not in result.stderr
