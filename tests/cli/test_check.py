"""msgflow check: what is printed, and when the exit code is 1."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import IO

import duckdb
import pytest
from support.golden import insert
from typer.testing import Result

from msgflow.db.derivation import derive_findings

Msgflow = Callable[..., Result]


@pytest.fixture(scope="module")
def _good(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    from support.golden import BASE

    path = Path(shutil.copy(empty_database, tmp_path_factory.mktemp("good") / "msgflow.duckdb"))
    with duckdb.connect(str(path)) as connection:
        for table, row in BASE.items():
            insert(connection, table, list(row), [list(row.values())])
        insert(connection, "node", ["node_id", "full_name"], [["1", "/node"]])
        insert(connection, "publication", ["publication_id"], [["1"]])
        insert(connection, "take", ["take_id", "method"], [["1", "rmw"]])
        insert(connection, "callback_instance", ["callback_instance_id", "end_ns"], [["1", "9"]])
        insert(connection, "executor_state", ["state"], [["wait"]])
        insert(connection, "link_transport", ["publication_id", "take_id"], [["1", "1"]])
    return path


@pytest.fixture
def database(_good: Path, tmp_path: Path) -> Path:
    """A run with something of every kind, to which tests add what is wrong."""
    return Path(shutil.copy(_good, tmp_path / "msgflow.duckdb"))


def add(path: Path, table: str, *rows: dict[str, str]) -> None:
    with duckdb.connect(str(path)) as connection:
        for row in rows:
            insert(connection, table, list(row), [list(row.values())])
        for (run_id,) in connection.execute("SELECT run_id FROM store.run").fetchall():
            derive_findings(connection, run_id)


def pause() -> dict[str, str]:
    return {"kind": "pause", "start_ns": "0", "end_ns": "1000000000"}


def loss(number: int) -> dict[str, str]:
    start = number * 1_000_000_000
    return {
        "kind": "loss",
        "start_ns": str(start),
        "end_ns": str(start + 500_000_000),
        "event_count": "100",
    }


def test_nothing_is_wrong(msgflow: Msgflow, database: Path) -> None:
    result = msgflow("check", "--db", database)
    assert result.exit_code == 0
    assert result.stdout == ""
    said, next_steps = result.stderr.split("next: ", maxsplit=1)
    assert said == "nothing is wrong with the recording\n"
    assert next_steps == f"msgflow why --db {database}\n"


def test_what_the_recording_cost(msgflow: Msgflow, database: Path, tmp_path: Path) -> None:
    """A million events in ten seconds; their cost stands beside the trace, or is the usual one."""
    trace = {"trace_id": "2", "path": str(tmp_path / "robot" / "ust" / "uid" / "0" / "64-bit")}
    trace |= {"domain": "ust", "event_count": "1000000", "start_ns": "0", "end_ns": "10000000000"}
    add(database, "trace", trace)

    def said() -> list[str]:
        lines = msgflow("check", "--db", database).stderr.splitlines()
        return [line for line in lines if line.startswith("tracing")]

    took = "tracing took about {} % of a CPU: 1,000,000 events, {} ns each (measured {})"
    assert said() == [took.format(1.6, 158, "elsewhere")]
    (tmp_path / "robot").mkdir()
    (tmp_path / "robot" / "event-cost-ns").write_text("200\n")
    assert said() == [took.format(2, 200, "there, before the recording")]


def test_warnings_leave_the_exit_code_at_0(msgflow: Msgflow, database: Path) -> None:
    add(database, "gap", pause())
    result = msgflow("check", "--db", database)
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert lines[0] == "1. warning: Tracing was paused (tracing_paused)"
    assert lines[1] == "   trace — 1 pause, 1.000 s in all, the longest 1.000 s"
    assert [line.strip().partition(":")[0] for line in lines[2:] if line[3:4] != " "] == [
        "means",
        "cause",
        "cure",
    ]
    said, next_steps = result.stderr.split("next: ", maxsplit=1)
    assert said == "0 errors, 1 warning\n"
    assert next_steps == f"msgflow why --db {database}\n"


def test_errors_make_it_1_and_come_first(msgflow: Msgflow, database: Path) -> None:
    add(database, "gap", pause(), loss(5))
    add(database, "packet", {"event_count": "900"})
    result = msgflow("check", "--db", database)
    assert result.exit_code == 1
    numbered = [line for line in result.stdout.splitlines() if line[:1].isdigit()]
    assert numbered == [
        "1. error: The tracer discarded events (discarded_events)",
        "2. warning: Tracing was paused (tracing_paused)",
    ]
    assert "--subbuf-size=128K" in result.stdout
    said, next_steps = result.stderr.split("next: ", maxsplit=1)
    assert said == "1 error, 1 warning\n"
    assert next_steps == f"msgflow why --db {database}\n"


def test_json_has_every_place_under_the_number_of_its_finding(
    msgflow: Msgflow, database: Path
) -> None:
    add(database, "process", *({"process_id": str(n), "pid": str(n)} for n in range(2, 14)))
    add(database, "gap", pause())
    result = msgflow("check", "--format", "json", "--db", database)
    rows = json.loads(result.stdout)
    assert [row["number"] for row in rows] == [1] * 12 + [2]
    assert {row["name"] for row in rows} == {"process_without_ros", "tracing_paused"}
    assert all(row["cause"] and row["cure"] and row["run_id"] == 1 for row in rows)


def test_many_places_are_cut_and_it_says_so(msgflow: Msgflow, database: Path) -> None:
    add(database, "process", *({"process_id": str(n), "pid": str(n)} for n in range(2, 14)))
    result = msgflow("check", "--db", database)
    assert "   … and 2 more; --format json has them all" in result.stdout.splitlines()


def test_a_run_that_does_not_exist(msgflow: Msgflow, database: Path) -> None:
    assert msgflow("check", "--run", "nothing", "--db", database).exit_code == 2


@pytest.mark.thorough
def test_findings_of_several_runs_say_which(msgflow: Msgflow, database: Path) -> None:
    add(database, "run", {"run_id": "2", "name": "other"})
    add(database, "gap", pause())
    alone = msgflow("check", "--run", "case", "--db", database).stdout
    assert "   trace — 1 pause, " in alone
    every = msgflow("check", "--run", "all", "--db", database).stdout
    assert "   run case (1): trace — 1 pause, " in every
    assert "   run other (2): everything — nothing was published" in every


@pytest.mark.thorough
def test_runs_of_a_label_are_several_runs(msgflow: Msgflow, database: Path) -> None:
    labels = {"labels": "['site=berlin']"}
    add(database, "run", *({"run_id": n, "name": f"other {n}"} | labels for n in ("2", "3")))
    result = msgflow("check", "--run", "site=berlin", "--db", database)
    assert "   run other 2 (2): everything — nothing was published" in result.stdout
    assert "   run other 3 (3): everything — nothing was published" in result.stdout


@pytest.mark.thorough
def test_the_next_step_is_about_one_run(msgflow: Msgflow, database: Path) -> None:
    def steps(*run: str) -> list[str]:
        lines = msgflow("check", *run, "--db", database).stderr.splitlines()
        return [line.partition(" --db")[0] for line in lines if line.startswith("next: ")]

    assert steps("--run", "all") == ["next: msgflow why --run 1"]
    add(database, "run", {"run_id": "2", "name": "second"})
    add(database, "run", {"run_id": "3", "name": "third"})
    # Nothing was published in both: the first of them.
    assert steps("--run", "all") == ["next: msgflow why --run 2"]
    assert steps("--run", "third") == ["next: msgflow why --run 3"]
    assert steps() == ["next: msgflow why"]


def test_a_database_without_runs(msgflow: Msgflow, fresh_database: Path) -> None:
    result = msgflow("check", "--db", fresh_database)
    assert result.exit_code == 0
    said, next_steps = result.stderr.split("next: ", maxsplit=1)
    assert said == "nothing is wrong with the recording\n"
    assert next_steps == f"msgflow ingest TRACE --db {fresh_database}\n"


@pytest.mark.thorough
def test_broken_rules_of_the_database_are_shown_alike(
    msgflow: Msgflow, fresh_database: Path
) -> None:
    assert msgflow("check", "--detail", "--db", fresh_database).exit_code == 0
    add(fresh_database, "run", {"run_id": "1", "name": "case"})
    add(fresh_database, "gap", {"kind": "hole"})
    assert msgflow("check", "--db", fresh_database).exit_code == 0
    result = msgflow("check", "--detail", "--db", fresh_database)
    assert result.exit_code == 1
    lines = result.stdout.splitlines()
    assert lines[0] == "1. error: A row refers to one that does not exist (relation_is_kept)"
    assert lines[1] == "   gap.trace_id — identities that are no row of trace"
    assert "2. error: A word is not of the vocabulary (vocabulary_is_closed)" in lines
    said, next_steps = result.stderr.split("next: ", maxsplit=1)
    assert said == "2 errors, 1 warning\n"
    assert next_steps == f"msgflow why --db {fresh_database}\n"
    rows = json.loads(
        msgflow("check", "--detail", "--format", "json", "--db", fresh_database).stdout
    )
    assert [(row["number"], row["phase"], row["count"]) for row in rows[:2]] == [
        (1, "database", 1),
        (2, "database", 1),
    ]


def test_findings_are_written_to_a_file(msgflow: Msgflow, database: Path, tmp_path: Path) -> None:
    add(database, "gap", pause())
    result = msgflow("check", "-o", tmp_path / "found.csv", "--db", database)
    assert result.stdout == ""
    header, row = (tmp_path / "found.csv").read_text().splitlines()
    assert header.startswith('"number","run_id","trace_id","name","phase","severity","subject"')
    assert row.startswith('1,1,1,"tracing_paused","recording","warning","trace",1,')


@pytest.mark.parametrize("words", [("check",), ("info",), ("flow", "--take", "1")])
def test_others_may_write_to_the_database_while_somebody_reads(
    words: tuple[str, ...], msgflow: Msgflow, database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The output waits for as long as a pager does not take it."""
    add(database, "gap", pause())
    written = []

    def slow() -> IO[bytes]:
        if not written:
            with duckdb.connect(str(database)) as connection:
                connection.execute("CREATE TABLE main.others (number BIGINT)")
            written.append(words)
        return sys.stdout.buffer

    monkeypatch.setattr("msgflow.cli.output.data_stream", slow)
    result = msgflow(*words, "--db", database)
    assert result.exit_code == 0, result.output
    assert written
    assert result.stdout
