"""`msgflow runs`: what a database holds can be renamed and removed."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.ingested import contents
from support.thorough import thorough
from typer.testing import Result

from msgflow.database import Database
from msgflow.db.finding import broken_rules
from msgflow.ingest import ingest
from msgflow_sim import simulate

Msgflow = Callable[..., Result]


@pytest.fixture(scope="module")
def ingested(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database of two runs, beside their traces: read it only."""
    directory = tmp_path_factory.mktemp("runs")
    for seed, name in ((1, "before"), (2, "after")):
        simulate("demo", directory / name, factor=0.02, seed=seed)
        ingest([directory / name], directory / "two.duckdb")
    return directory / "two.duckdb"


@pytest.fixture
def database(ingested: Path, tmp_path: Path) -> Path:
    """A copy, to change it."""
    return Path(shutil.copy(ingested, tmp_path / "two.duckdb"))


def of_run(database: Path, run_id: int) -> dict[str, list[tuple[Any, ...]]]:
    """Return what each table has of a run."""
    with duckdb.connect(str(database), read_only=True) as connection:
        tables = connection.execute(
            "SELECT table_name FROM duckdb_columns() "
            "WHERE schema_name = 'store' AND column_name = 'run_id' ORDER BY 1"
        ).fetchall()
        return {
            table: connection.execute(
                f"FROM store.{table} WHERE run_id = ? ORDER BY ALL", [run_id]
            ).fetchall()
            for (table,) in tables
        }


def names(msgflow: Msgflow, database: Path) -> list[str]:
    result = msgflow("runs", "list", "--format", "json", "--db", database)
    assert result.exit_code == 0
    assert "run:" not in result.stderr
    return [row["name"] for row in json.loads(result.stdout)]


def test_remove_leaves_the_others_as_they_were(msgflow: Msgflow, database: Path) -> None:
    kept = of_run(database, 2)
    result = msgflow("runs", "remove", "before", "--db", database)
    assert result.exit_code == 0
    assert result.stderr == "run 1 removed: before\n"
    assert names(msgflow, database) == ["after"]
    assert not any(of_run(database, 1).values())
    assert of_run(database, 2) == kept
    assert kept["publication"]
    with Database(database) as opened:
        assert opened.sql("SELECT DISTINCT run_id FROM publication").to_arrow().to_pylist() == [
            {"run_id": 2}
        ]
        assert broken_rules(opened.connection, 2) == []


@pytest.mark.thorough
def test_what_was_removed_can_be_ingested_again(
    msgflow: Msgflow, database: Path, ingested: Path
) -> None:
    assert msgflow("runs", "remove", "before", "--db", database).exit_code == 0
    assert msgflow("ingest", ingested.parent / "before", "--db", database).exit_code == 0
    assert names(msgflow, database) == ["after", "before"]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("answer", "options", "code", "left"),
    [
        (b"n\n", [], 130, ["before", "after"]),
        thorough(b"\n", [], 130, ["before", "after"]),
        (b"y\n", [], 0, ["after"]),
        thorough(b"", ["--yes"], 0, ["after"]),
    ],
)
def test_on_a_terminal_it_asks_before_it_removes(
    msgflow: Msgflow, database: Path, answer: bytes, options: list[str], code: int, left: list[str]
) -> None:
    leader, follower = pty.openpty()
    program = [sys.executable, "-m", "msgflow", "runs", "remove", "before", *options]
    with subprocess.Popen(
        [*program, "--db", str(database)], stdin=follower, stdout=follower, stderr=follower
    ) as process:
        os.close(follower)
        os.write(leader, answer)
        said = b""
        # Linux says by an error that nobody holds the other end any more.
        with contextlib.suppress(OSError):
            while part := os.read(leader, 65536):
                said += part
        assert process.wait(timeout=30) == code
    os.close(leader)
    assert (b"remove before (1)? [y/N]" in said) == (not options)
    assert (b"nothing was removed" in said) == (code == 130)
    assert names(msgflow, database) == left


def test_without_a_command_runs_are_listed_and_clocks_shown(
    msgflow: Msgflow, database: Path
) -> None:
    for group, command in (("runs", "list"), ("clocks", "show")):
        for words in ([], ["--format", "json"]):
            bare = msgflow(group, *words, "--db", database)
            assert bare.exit_code == 0
            named = msgflow(group, command, *words, "--db", database)
            assert (bare.stdout, bare.stderr) == (named.stdout, named.stderr)
        text = msgflow(group, "--help")
        assert text.exit_code == 0
        assert f"without a command: {command}" in " ".join(text.stdout.split())
        assert msgflow(group, "lists").exit_code == 2


def test_remove_all_leaves_no_row(msgflow: Msgflow, database: Path) -> None:
    assert msgflow("runs", "remove", "all", "--db", database).exit_code == 0
    assert names(msgflow, database) == []
    rows = contents(database)
    # What the file itself is made of.
    assert {table for table, found in rows.items() if found} == {"alembic_version", "definition"}


def test_rename(msgflow: Msgflow, database: Path) -> None:
    result = msgflow("runs", "rename", 1, "tuned", "--db", database)
    assert result.exit_code == 0
    assert result.stderr == "run 1 renamed: before is tuned\n"
    assert names(msgflow, database) == ["tuned", "after"]
    assert msgflow("runs", "rename", "tuned", "tuned", "--db", database).exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("remove", "befor"), "there is no such run — befor"),
        (("rename", "befor", "x"), "there is no such run — befor"),
        (("rename", "before", "after"), "has a run of that name already — after"),
        (("rename", "before", "all"), "takes for something else — 'all'"),
        (("rename", "before", "7"), "takes for something else — '7'"),
        (("rename", "all", "x"), "one run has one name — all"),
    ],
)
def test_what_cannot_be_changed(
    msgflow: Msgflow, database: Path, arguments: tuple[str, ...], message: str
) -> None:
    result = msgflow("runs", *arguments, "--db", database)
    assert result.exit_code == 2
    assert message in result.stderr
    assert names(msgflow, database) == ["before", "after"]


def test_a_name_with_escape_codes_is_text(msgflow: Msgflow, database: Path) -> None:
    assert msgflow("runs", "rename", 1, "\x1b[31mred\n", "--db", database).exit_code == 0
    result = msgflow("runs", "rename", 1, "plain", "--db", database)
    assert "\\x1b[31mred" in result.stderr


def test_a_missing_database_is_not_made(msgflow: Msgflow, tmp_path: Path) -> None:
    assert msgflow("runs", "remove", "1", "--db", tmp_path / "none.duckdb").exit_code == 4
    assert not (tmp_path / "none.duckdb").exists()


def labels(msgflow: Msgflow, database: Path) -> list[list[str] | None]:
    result = msgflow("runs", "list", "--format", "json", "--db", database)
    return [row["labels"] for row in json.loads(result.stdout)]


def test_labels(msgflow: Msgflow, database: Path) -> None:
    def label(*words: object) -> str:
        result = msgflow("runs", "label", *words, "--db", database)
        assert result.exit_code == 0
        return result.stderr

    assert label("before", "robot=r2d2", "build=a=b c") == "run 1 labelled: before\n"
    assert labels(msgflow, database) == [["build=a=b c", "robot=r2d2"], None]
    info = json.loads(msgflow("info", "--format", "json", "--db", database).stdout)
    assert info["runs"][0]["labels"] == ["build=a=b c", "robot=r2d2"]
    assert "robot=r2d2" in msgflow("runs", "list", "--db", database).stdout
    assert label("all", "robot=c3po").splitlines()[1] == "run 2 labelled: after"
    assert labels(msgflow, database) == [["build=a=b c", "robot=c3po"], ["robot=c3po"]]
    label("before", "robot=", "place=lab")
    assert labels(msgflow, database) == [["build=a=b c", "place=lab"], ["robot=c3po"]]
    label(2, "robot=")
    assert labels(msgflow, database) == [["build=a=b c", "place=lab"], None]
    with Database(database) as opened:
        sql = "SELECT name FROM run WHERE list_contains(labels, 'place=lab')"
        assert opened.sql(sql).to_arrow().to_pylist() == [{"name": "before"}]


def test_a_label_without_a_value_is_kept(msgflow: Msgflow, database: Path) -> None:
    with duckdb.connect(str(database)) as con:
        con.execute("UPDATE store.run SET labels = ['plain'] WHERE run_id = 1")
    assert msgflow("runs", "label", "before", "robot=r1", "--db", database).exit_code == 0
    assert labels(msgflow, database)[0] == ["plain=", "robot=r1"]


@pytest.mark.thorough
def test_a_label_chooses_runs(msgflow: Msgflow, database: Path) -> None:
    for run in ("before", "after"):
        assert (
            msgflow("runs", "label", run, "robot=r2", f"n={run}", "--db", database).exit_code == 0
        )

    def runs(label: str) -> str:
        return msgflow("info", "--section", "hosts", "--run", label, "--db", database).stderr

    assert runs("n=before") == "run: before (1)\n"
    assert runs("robot=r2") == "runs: before (1), after (2)\n"
    assert "there is no such run — n=b" in runs("n=b")
    assert msgflow("runs", "rename", 1, "n=after", "--db", database).exit_code == 0
    assert runs("n=after") == "run: n=after (1)\n"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("x=1", "no label"), "a label is KEY=VALUE — no label"),
        thorough(("x=1", "=2"), "no key of a label — ''"),
        thorough(("x=1", "1x=2"), "no key of a label — '1x'"),
        thorough(("x=1", "a b=2"), "no key of a label — 'a b'"),
        thorough(("x=1", "\x1b[31m=2"), "no key of a label — '\\x1b[31m'"),
        thorough(("x=1", "x=2"), "a run has one label of a key — x"),
        thorough(("x=1", f"y={'z' * 1001}"), "no value of a label — y"),
        (("x=1", "y="), "run 1 has no label of this key — y"),
    ],
)
def test_all_labels_or_none(
    msgflow: Msgflow, database: Path, words: tuple[str, ...], message: str
) -> None:
    assert msgflow("runs", "label", 2, "y=2", "--db", database).exit_code == 0
    result = msgflow("runs", "label", "all", *words, "--db", database)
    assert result.exit_code == 2
    assert message in result.stderr
    assert labels(msgflow, database) == [None, ["y=2"]]


def test_a_label_with_escape_codes_and_quotes_is_text(msgflow: Msgflow, database: Path) -> None:
    value = "\x1b[31m'; DROP TABLE run; --\n"
    assert msgflow("runs", "label", 1, f"x={value}", "--db", database).exit_code == 0
    assert labels(msgflow, database) == [[f"x={value}"], None]
    shown = msgflow("runs", "list", "--wide", "--db", database).stdout
    assert "\x1b" not in shown
    assert "DROP TABLE run; --\\n" in shown
