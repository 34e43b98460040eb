"""Whatever goes wrong: a message, an exit code, and no traceback."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pytest
from typer.testing import Result

from msgflow.database import Database
from msgflow.errors import ExitCode

Msgflow = Callable[..., Result]


def break_with(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(Database, "findings", fail)


def test_the_unexpected_is_one_line(msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch) -> None:
    break_with(monkeypatch, ValueError("first\nsecond"))
    result = msgflow("check")
    assert result.exit_code == ExitCode.FAILED
    assert result.stdout == ""
    error, _, hint = result.stderr.partition("\n\n")
    assert error == "error: unexpected ValueError: first"
    assert "MSGFLOW_DEBUG=1" in hint
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize(
    "error", [MemoryError(), pa.ArrowMemoryError("x"), RuntimeError("can't start new thread")]
)
def test_a_process_that_may_not_have_more_says_so(
    msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    break_with(monkeypatch, error)
    result = msgflow("check")
    assert result.exit_code == ExitCode.FAILED
    assert "error: the system gives this process no more memory or threads" in result.stderr
    assert "ulimit" in result.stderr


def test_the_unexpected_can_be_traced(msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MSGFLOW_DEBUG", "1")
    break_with(monkeypatch, ValueError("first"))
    result = msgflow("check")
    assert result.exit_code == ExitCode.FAILED
    assert "Traceback" in result.stderr
    assert "report it" in result.stderr


def test_an_interrupt_has_code_130(msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch) -> None:
    break_with(monkeypatch, KeyboardInterrupt())
    result = msgflow("check")
    assert result.exit_code == ExitCode.INTERRUPTED
    assert result.stderr == "error: interrupted\n"


def test_messages_have_no_colour_in_a_pipe(msgflow: Msgflow) -> None:
    result = msgflow("info")
    assert "\x1b" not in result.stderr
    assert result.stderr.startswith("error: ")


def test_nothing_is_left_of_a_file_that_failed(
    msgflow: Msgflow, small_database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ValueError("no")

    monkeypatch.setattr("msgflow.cli.output.write_result", fail)
    Path("out.csv").write_text("before")
    assert msgflow("sql", "FROM run", "--db", small_database, "-o", "out.csv").exit_code == 1
    assert Path("out.csv").read_text() == "before"
    assert [path.name for path in Path().iterdir()] == ["out.csv"]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("query callback-schedule", "msgflow query scheduling"),
        ("query thread-states", "msgflow query scheduling --measure threads"),
        ("query cpu-usage", "msgflow query scheduling --measure cpu"),
        (
            "query preemption",
            "msgflow query scheduling --measure preemption or msgflow query waits --by pair",
        ),
        ("query wakeup-latency", "msgflow query scheduling --measure wakeup"),
        ("query clocks", "msgflow clocks"),
        ("query clocks-pair", "msgflow clocks --by pair"),
        ("query graph --help", "msgflow graph"),
        ("query info", "msgflow info"),
        ("query info --section nodes", "msgflow info --section nodes"),
        ("query info-nodes", "msgflow info --section nodes"),
        ("query links", "msgflow links"),
    ],
)
def test_an_old_name_says_the_new_one(msgflow: Msgflow, old: str, new: str) -> None:
    result = msgflow(*old.split())
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith("error: ")
    assert result.stderr.endswith(f"\n\nhint: {new}\n")
