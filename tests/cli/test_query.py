from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from typer.testing import Result

from msgflow.query.catalogue import load_queries, load_query, query_names

Msgflow = Callable[..., Result]


def test_the_list_names_every_query(msgflow: Msgflow) -> None:
    result = msgflow("query")
    assert result.exit_code == 0
    for header in load_queries():
        assert (header.words in result.stdout) is not header.is_command
        assert (header.title in result.stdout) is not header.is_command


# Of the queries that are commands: how they are asked for their rows.
ASKED = {"clocks": "clocks show", "info": "info --section runs", "links": "links list"}


@pytest.mark.parametrize("name", query_names())
def test_help_tells_what_a_query_means_and_takes(msgflow: Msgflow, name: str) -> None:
    command = load_query(name).command.removeprefix("msgflow ")
    result = msgflow(*ASKED.get(name, command).split(), "--help")
    assert result.exit_code == 0
    header = next(header for header in load_queries() if header.name == name)
    words = "".join(result.stdout.split())
    assert "".join(header.description.split())[:60] in words
    for param in header.params:
        if param.name == "take":
            continue
        assert f"--{param.name.replace('_', '-')}" in words
    for column in header.columns:
        assert column.name in words


def test_show_prints_the_file_and_opens_nothing(msgflow: Msgflow) -> None:
    result = msgflow("query", "topics", "--show")
    assert result.exit_code == 0
    assert result.stdout == next(
        header.path.read_text() for header in load_queries() if header.name == "topics"
    )


def test_rows_go_to_stdout_and_words_to_stderr(msgflow: Msgflow, small_database: Path) -> None:
    result = msgflow("query", "topics", "--db", small_database)
    assert result.exit_code == 0
    assert "/chatter" in result.stdout
    assert "/rosout" not in result.stdout
    run, left_out, *notes = result.stderr.splitlines()
    assert run == "run: noon (2)"
    assert left_out.startswith("not shown: ")
    assert notes == [
        "note: 1 internal row is hidden; --internal shows them",
    ]


def test_options_select(msgflow: Msgflow, small_database: Path) -> None:
    def rows(*options: str) -> list[dict[str, object]]:
        arguments = ("query", "topics", "--db", small_database, "--format", "json")
        return json.loads(msgflow(*arguments, *options).stdout)

    assert [row["run_id"] for row in rows()] == [2]
    assert [row["run_id"] for row in rows("--run", "morning")] == [1]
    assert [row["run_id"] for row in rows("--run", "all")] == [1, 2]
    assert [row["topic_name"] for row in rows("--internal")] == ["/chatter", "/rosout"]


def test_the_database_comes_from_the_environment_or_lies_here(
    msgflow: Msgflow, small_database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert msgflow("info", "--section", "runs").exit_code == 4
    Path("msgflow.duckdb").symlink_to(small_database)
    assert msgflow("info", "--section", "runs").exit_code == 0
    Path("msgflow.duckdb").unlink()
    monkeypatch.setenv("MSGFLOW_DB", str(small_database))
    assert msgflow("info", "--section", "runs").exit_code == 0
    assert msgflow("info", "--section", "runs", "--db", "none.duckdb").exit_code == 4


def test_a_file_is_written_in_the_format_of_its_suffix(
    msgflow: Msgflow, small_database: Path
) -> None:
    result = msgflow("info", "--section", "runs", "--db", small_database, "-o", "runs.parquet")
    assert result.exit_code == 0
    assert result.stdout == ""
    assert "1 row written to runs.parquet" in result.stderr
    assert pq.read_table("runs.parquet")["name"].to_pylist() == ["noon"]
    msgflow("info", "--section", "runs", "--db", small_database, "-o", "runs.x", "--format", "csv")
    assert Path("runs.x").read_text().startswith('"run_id","name"')


def test_durations_and_times_are_for_people_in_tables_only(
    msgflow: Msgflow, small_database: Path
) -> None:
    arguments = ("info", "--section", "runs", "--db", small_database, "--format")
    table = msgflow(*arguments, "table").stdout
    assert "2.500 s" in table
    assert "2023-11-14T22:13:30.000000000Z" in table
    assert "duration_ns" not in table
    row = json.loads(msgflow(*arguments, "jsonl").stdout)
    assert row["duration_ns"] == 2_500_000_000
    assert row["start_ns"] == 1_700_000_010_000_000_000


@pytest.mark.parametrize(
    ("arguments", "code", "error", "hint"),
    [
        (("query", "info-topic"), 2, "there is no such query — info-topic", "msgflow query topics"),
        (("query", "topics", "--limits", "3"), 2, "no such option: --limits", "topics --help"),
        (("links", "--limits", "3"), 2, "no such option: --limits", "links list --help"),
        (("query", "topics", "--run", "x"), 2, "there is no such run — x", "morning (1), noon (2)"),
        (
            ("info", "--section", "runs", "--start", "1s"),
            2,
            "no time window — info",
            "leave out --start",
        ),
        (
            ("query", "topics", "--format", "xml"),
            2,
            "'--format': 'xml' is not one of",
            "topics --help",
        ),
        (("query", "topics", "--list"), 2, "no such option: --list", "topics --help"),
        (("query", "--list", "topics"), 2, "no such option: --list", "msgflow query"),
        (
            ("query", "topics", "-o", "no/dir/x.csv"),
            2,
            "no such file or directory",
            "can be written",
        ),
    ],
)
def test_mistakes_have_a_message_and_a_code(
    msgflow: Msgflow,
    small_database: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    code: int,
    error: str,
    hint: str,
) -> None:
    monkeypatch.setenv("MSGFLOW_DB", str(small_database))
    result = msgflow(*arguments)
    assert result.exit_code == code
    assert result.stdout == ""
    message, _, rest = result.stderr.removeprefix("run: noon (2)\n").partition("\n\nhint: ")
    assert message.startswith("error: ")
    assert error in message
    assert hint in rest


def test_times_are_chosen_for_programs_only(msgflow: Msgflow, small_database: Path) -> None:
    result = msgflow(
        "info", "--section", "runs", "--db", small_database, "--format", "jsonl", "--times", "iso"
    )
    assert result.exit_code == 0
    row = json.loads(result.stdout)
    assert row["start_utc"].endswith("Z")
    assert "duration_s" in row
    refused = msgflow("info", "--section", "runs", "--db", small_database, "--times", "iso")
    assert refused.exit_code == 2
    assert "--times" in refused.stderr


def test_a_suffix_of_no_format_is_refused(msgflow: Msgflow, small_database: Path) -> None:
    for name in ("runs.xlsx", "runs.png"):
        result = msgflow("info", "--section", "runs", "--db", small_database, "-o", name)
        assert result.exit_code == 2
        assert name in result.stderr
        assert not Path(name).exists()
    assert (
        msgflow("info", "--section", "runs", "--db", small_database, "-o", "runs.txt").exit_code
        == 0
    )
    assert Path("runs.txt").read_text().startswith("run_id")
