"""Ctrl-C in an ingest: nothing has changed, or the run is stored and the exit code says so."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from support.ingested import contents
from support.thorough import few

from msgflow.errors import ExitCode

# The command line, which says on stdout when a stage begins and then waits for the signal.
_COMMAND = """
import sys, time
from msgflow.__main__ import main
from msgflow.cli import progress
from contextlib import contextmanager

awaited = sys.argv.pop(1)

@contextmanager
def watched(quiet):
    def show(state):
        if state.stage == awaited and not shown:
            shown.append(state)
            print(state.stage, flush=True)
            time.sleep(0.2)
    shown = []
    yield show

progress.ingest_progress = watched
main()
"""
STAGES = (
    "opening the traces",
    "reading the traces",
    "building the model",
    "storing the run",
    "linking messages",
)


def interrupted_at(
    stage: str,
    trace: Path,
    database: Path,
    signals: int = 1,
    number: signal.Signals = signal.SIGINT,
) -> tuple[int, str]:
    """Return exit code and stderr of an ingest that gets Ctrl-C when `stage` begins."""
    arguments = [stage, "ingest", str(trace), "--db", str(database)]
    with subprocess.Popen(
        [sys.executable, "-c", _COMMAND, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == f"{stage}\n"
        for _ in range(signals):
            process.send_signal(number)
        _, errors = process.communicate(timeout=60)
    return process.returncode, errors


@pytest.mark.parametrize("stage", few(STAGES, "linking messages"))
def test_an_interrupt_leaves_nothing(trace: Path, new_database: Path, stage: str) -> None:
    assert interrupted_at(stage, trace, new_database) == (
        ExitCode.INTERRUPTED,
        "error: interrupted\n",
    )
    assert os.listdir(new_database.parent) == []


@pytest.mark.parametrize("stage", few(STAGES, "building the model"))
@pytest.mark.parametrize("ignored", few([False, True], True))
def test_a_termination_leaves_nothing(
    trace: Path, new_database: Path, stage: str, ignored: bool
) -> None:
    """Also where Ctrl-C is ignored, as in the background jobs of a shell."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN) if ignored else None
    try:
        ended = interrupted_at(stage, trace, new_database, number=signal.SIGTERM)
    finally:
        if before is not None:
            signal.signal(signal.SIGINT, before)
    assert ended == (ExitCode.TERMINATED, "error: terminated\n")
    assert os.listdir(new_database.parent) == []


@pytest.mark.thorough
def test_a_termination_that_comes_too_late_is_none(database: Path, other_trace: Path) -> None:
    code, errors = interrupted_at(
        "closing the database", other_trace, database, number=signal.SIGTERM
    )
    assert code == ExitCode.OK
    assert "as run pair (2)" in errors


@pytest.mark.thorough
@pytest.mark.parametrize(
    "stage", few(["reading the traces", "linking messages"], "linking messages")
)
def test_an_impatient_interrupt_leaves_the_database_as_it_was(
    database: Path, other_trace: Path, stage: str
) -> None:
    before = contents(database)
    code, errors = interrupted_at(stage, other_trace, database, signals=3)
    assert (code, errors) == (ExitCode.INTERRUPTED, "error: interrupted\n")
    assert contents(database) == before
    assert os.listdir(database.parent) == [database.name]


@pytest.mark.thorough
@pytest.mark.parametrize("signals", few([1, 3], 3))
def test_an_interrupt_that_comes_too_late_is_none(
    database: Path, other_trace: Path, signals: int
) -> None:
    """The run is stored already, so that is what is reported."""
    code, errors = interrupted_at("closing the database", other_trace, database, signals)
    assert code == ExitCode.OK
    assert "as run pair (2)" in errors
    assert [name for _, name, *_ in contents(database)["run"]] == ["robot", "pair"]
    assert os.listdir(database.parent) == [database.name]
