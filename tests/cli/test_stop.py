"""Ctrl-C and SIGTERM at any moment of the program: its exit code, one line, no traceback."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from msgflow.errors import ExitCode

# Calls of Python functions are counted, from the first line that is ours; at a given one the
# process sends itself a signal.
_COUNTING = """
import os, signal, sys
import msgflow.cli.stop

number, at = int(sys.argv[1]), int(sys.argv[2])
sys.argv[1:] = sys.argv[3:]
count = 0

def called(frame, event, argument):
    global count
    if event != "call" or frame.f_code.co_filename == msgflow.cli.stop.__file__:
        return
    count += 1
    if count == at:
        signal.raise_signal(number)

import msgflow.__main__
install = msgflow.cli.stop.STOP.install

def installed():
    install()
    sys.setprofile(called)

msgflow.cli.stop.STOP.install = installed
try:
    msgflow.__main__.main()
finally:
    sys.setprofile(None)
    if not at:
        os.write(2, str(count).encode())
"""
_ENDINGS = {
    signal.SIGINT: (ExitCode.INTERRUPTED, "error: interrupted\n"),
    signal.SIGTERM: (ExitCode.TERMINATED, "error: terminated\n"),
}


def python(program: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.parametrize("number", _ENDINGS)
def test_at_any_moment_a_signal_ends_the_program_cleanly(
    small_database: Path, number: signal.Signals
) -> None:
    arguments = ("query", "info-runs", "--db", small_database)
    whole = python(_COUNTING, int(number), 0, *arguments)
    assert whole.returncode == 0
    calls = int(whole.stderr.rsplit("\n", 1)[-1])
    ended = set()
    for part in range(5):
        done = python(_COUNTING, int(number), 1 + calls * part // 5, *arguments)
        ended.add((done.returncode, done.stderr.removeprefix("runs: morning (1), noon (2)\n")))
    assert ended == {_ENDINGS[number]}


_IMPORTING = """
import signal, sys
import msgflow.cli.root, msgflow.cli.stop
from msgflow.cli.app import app

def called(frame, event, argument):
    if event == "call" and "_create_" in frame.f_code.co_name and "_duckdb" in sys.modules:
        sys.setprofile(None)
        signal.raise_signal(int(sys.argv[1]))

msgflow.cli.stop.STOP.install()
sys.setprofile(called)
app(["sql", "SELECT sum(i) FROM range(1_000_000_000_000) AS r (i)", "--db", sys.argv[2]])
"""


@pytest.mark.parametrize("number", _ENDINGS)
def test_a_signal_while_duckdb_is_imported(small_database: Path, number: signal.Signals) -> None:
    """Its C++ code would abort the process at an exception."""
    done = python(_IMPORTING, int(number), small_database)
    assert (done.returncode, done.stderr) == _ENDINGS[number]


_EARLY = """
import os, signal, sys
import msgflow.__main__

number = int(sys.argv[1])

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "msgflow.cli.stop":
            signal.raise_signal(number)

sys.meta_path.insert(0, Finder())
msgflow.__main__.main()
"""


@pytest.mark.parametrize("number", _ENDINGS)
def test_before_anything_is_imported_a_signal_ends_the_process(number: signal.Signals) -> None:
    done = python(_EARLY, int(number))
    assert (done.returncode, done.stderr) == (-number, "")


_BROKEN = """
import signal, sys
import msgflow.cli.root, msgflow.cli.stop
from msgflow.cli.app import app

msgflow.cli.root._usage = lambda error: signal.raise_signal(int(sys.argv[1]))
msgflow.cli.stop.STOP.install()
app(["nonsense"])
"""


@pytest.mark.parametrize("number", _ENDINGS)
def test_a_signal_while_an_error_is_told(number: signal.Signals) -> None:
    done = python(_BROKEN, int(number))
    assert (done.returncode, done.stderr) == _ENDINGS[number]


_FAILING = """
import signal, sys
import msgflow.cli.app, msgflow.cli.stop
from msgflow.errors import DatabaseError

def failing(self, context):
    {body}

import typer.core
typer.core.TyperGroup.invoke = failing
msgflow.cli.stop.STOP.install()
msgflow.cli.app.app(["info"])
"""


@pytest.mark.parametrize("number", _ENDINGS)
@pytest.mark.parametrize(
    "body",
    [
        # Libraries make an exception of their own of it.
        "try: signal.raise_signal({0})\n    except KeyboardInterrupt: raise DatabaseError('x')",
        # A second one while the first is dealt with.
        "try: signal.raise_signal({0})\n    finally: signal.raise_signal({0})",
        # In a finalizer Python would print it, and go on.
        "import weakref\n    thing = set()\n"
        "    reference = weakref.ref(thing, lambda _: signal.raise_signal({0}))\n    del thing",
        # It ends the command, and another comes behind.
        "import atexit; atexit.register(signal.raise_signal, {0}); signal.raise_signal({0})",
    ],
)
def test_no_signal_is_lost_or_taken_for_an_error(number: signal.Signals, body: str) -> None:
    done = python(_FAILING.replace("{body}", body.replace("{0}", str(int(number)))))
    assert (done.returncode, done.stderr) == _ENDINGS[number]


@pytest.mark.parametrize("number", _ENDINGS)
def test_after_its_end_a_signal_changes_nothing(number: signal.Signals) -> None:
    program = (
        "import atexit, signal, msgflow.cli.stop\n"
        f"atexit.register(signal.raise_signal, {int(number)})\n"
        "msgflow.cli.stop.STOP.install()\n"
        f"atexit.register(signal.raise_signal, {int(number)})\n"
        "from msgflow.cli.app import app\n"
        "app(['--version'])\n"
    )
    done = python(program)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("number", _ENDINGS)
def test_what_the_caller_wants_ignored_is(number: signal.Signals) -> None:
    program = (
        f"import signal; signal.signal({int(number)}, signal.SIG_IGN)\n"
        "import msgflow.cli.stop\n"
        "msgflow.cli.stop.STOP.install()\n"
        f"signal.raise_signal({int(number)})\n"
    )
    assert python(program).returncode == 0
