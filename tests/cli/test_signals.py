"""Ctrl-C, SIGTERM and SIGHUP at any moment of the program: no traceback.

Once the handler is in place, they end it with an exit code and one line; before, at once.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from support.thorough import few, thorough

from msgflow.errors import ExitCode

# Counts the calls of Python functions from where the handler is in place. At a given one the
# process sends itself a signal.
_COUNTING = """
import os, signal, sys
from msgflow.__main__ import main
from msgflow.cli import signals

number, at = int(sys.argv[1]), int(sys.argv[2])
sys.argv[1:] = sys.argv[3:]
count = 0

def called(frame, event, argument):
    global count
    if event != "call" or frame.f_code.co_filename == signals.__file__:
        return
    count += 1
    if count == at:
        signal.raise_signal(number)

class Counting(signals.SignalHandler):
    def run(self, program):
        def counted():
            sys.setprofile(called)
            program()
        super().run(counted)

signals.HANDLER.__class__ = Counting
try:
    main()
finally:
    sys.setprofile(None)
    if not at:
        os.write(2, str(count).encode())
"""
_ENDINGS = {
    signal.SIGINT: (ExitCode.INTERRUPTED, "error: interrupted\n"),
    signal.SIGTERM: (ExitCode.TERMINATED, "error: terminated\n"),
    signal.SIGHUP: (ExitCode.TERMINATED, "error: terminated\n"),
}


def python(program: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.parametrize("number", few(_ENDINGS, signal.SIGINT))
def test_a_signal_ends_the_program_cleanly(small_database: Path, number: signal.Signals) -> None:
    arguments = ("info", "--section", "runs", "--db", small_database)
    whole = python(_COUNTING, int(number), 0, *arguments)
    assert whole.returncode == 0
    calls = int(whole.stderr.rsplit("\n", 1)[-1])
    ended = set()
    for part in range(5):
        done = python(_COUNTING, int(number), 1 + calls * part // 5, *arguments)
        ended.add((done.returncode, done.stderr.removeprefix("run: noon (2)\n")))
    assert ended == {_ENDINGS[number]}


# Sends a signal at each import of a part of the command line; the first is that of the handler.
_STARTING = """
import signal, sys
from msgflow.__main__ import main

class Importing:
    def find_spec(name, path=None, target=None):
        if name.startswith("msgflow.cli"):
            signal.raise_signal(number)

sys.meta_path.insert(0, Importing)
number, sys.argv[1:] = int(sys.argv[1]), ["--version"]
main()
"""


@pytest.mark.parametrize("number", few(_ENDINGS, signal.SIGINT))
def test_a_signal_in_front_of_the_handler(number: signal.Signals) -> None:
    done = python(_STARTING, int(number))
    assert (done.returncode, done.stderr) == (-number, "")


_IMPORTING = """
import signal, sys
from msgflow.__main__ import main

def called(frame, event, argument):
    if event == "call" and "_create_" in frame.f_code.co_name and "_duckdb" in sys.modules:
        sys.setprofile(None)
        signal.raise_signal(number)

sys.setprofile(called)
number, sys.argv[1:] = int(sys.argv[1]), ["sql", "FROM run", "--db", sys.argv[2]]
main()
"""


@pytest.mark.parametrize("number", few(_ENDINGS, signal.SIGINT))
def test_a_signal_while_duckdb_is_loaded(small_database: Path, number: signal.Signals) -> None:
    """Its C++ code would abort the process at an exception."""
    done = python(_IMPORTING, int(number), small_database)
    assert (done.returncode, done.stderr) == _ENDINGS[number]


_LOSING = """
import signal, sys
from msgflow.__main__ import main

class Losing:
    def find_spec(name, path=None, target=None):
        if name == "msgflow.cli.info":
            try:
                signal.raise_signal(number)
            except KeyboardInterrupt:
                pass

sys.meta_path.insert(0, Losing)
number, sys.argv[1:] = int(sys.argv[1]), ["info", "--db", sys.argv[2]]
main()
"""


@pytest.mark.parametrize("number", few(_ENDINGS, signal.SIGINT))
def test_a_signal_that_an_import_would_lose(small_database: Path, number: signal.Signals) -> None:
    """Code in C forgets exceptions of the Python code that it imports."""
    done = python(_LOSING, int(number), small_database)
    assert (done.returncode, done.stdout, done.stderr) == (
        _ENDINGS[number][0],
        "",
        _ENDINGS[number][1],
    )


_FAILING = """
import signal, sys
from msgflow.__main__ import main
from msgflow.cli import app, info
from msgflow.errors import DatabaseError

def failing():
    {body}

info.command = failing
sys.argv[1:] = ["info"]
main()
"""


def failing(number: signal.Signals, body: str) -> tuple[int, str]:
    done = python(_FAILING.replace("{body}", body.replace("{0}", str(int(number)))))
    return done.returncode, done.stderr


@pytest.mark.parametrize("number", _ENDINGS)
@pytest.mark.parametrize(
    "body",
    [
        # Libraries turn it into an exception of their own.
        thorough(
            "try: signal.raise_signal({0})\n    except KeyboardInterrupt: raise DatabaseError('x')"
        ),
        # A library ignores it.
        "try: signal.raise_signal({0})\n    except KeyboardInterrupt: pass",
    ],
)
def test_no_signal_is_lost_or_taken_for_an_error(number: signal.Signals, body: str) -> None:
    assert failing(number, body) == _ENDINGS[number]


@pytest.mark.parametrize("number", few(_ENDINGS, signal.SIGINT))
def test_a_signal_while_an_error_is_printed(number: signal.Signals) -> None:
    broken = "app.print_exception = lambda error: signal.raise_signal({0})\n    raise ValueError"
    assert failing(number, broken) == _ENDINGS[number]


@pytest.mark.parametrize("number", few(_ENDINGS, signal.SIGINT))
@pytest.mark.parametrize(
    "body",
    [
        # A second one while the command tidies up.
        "try: signal.raise_signal({0})\n    finally: signal.raise_signal({0})",
        # In a finalizer Python would print it, and go on.
        "import weakref\n    thing = set()\n"
        "    reference = weakref.ref(thing, lambda _: signal.raise_signal({0}))\n    del thing",
    ],
)
def test_the_process_ends_at_once(number: signal.Signals, body: str) -> None:
    code, words = failing(number, body)
    assert words == ""
    # What a finalizer loses is known as Ctrl-C or not.
    is_lost = "weakref" in body and number == signal.SIGHUP
    assert code == -(signal.SIGTERM if is_lost else number)


@pytest.mark.parametrize("number", few(_ENDINGS, signal.SIGINT))
def test_after_its_end_a_signal_changes_nothing(number: signal.Signals) -> None:
    program = (
        "import atexit, signal, sys\n"
        "from msgflow.__main__ import main\n"
        f"atexit.register(signal.raise_signal, {int(number)})\n"
        "sys.argv[1:] = ['--version']\n"
        "main()\n"
    )
    done = python(program)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("number", few(_ENDINGS, signal.SIGINT))
def test_what_the_caller_wants_ignored_is(number: signal.Signals) -> None:
    ignored = f"import signal; signal.signal({int(number)}, signal.SIG_IGN)\n"
    assert python(ignored + _STARTING, int(number)).returncode == 0


_BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
# In a process of its own, as some commands are forked from it.
_SLICE = """
import json, signal
import signals
both = signal.SIGINT, signal.SIGKILL
ends = signals.moments(12, 1, signals=both, start=signals.forked)
print(json.dumps([signals.NAMES, list(ends)]))
"""


@pytest.mark.thorough
def test_commands_that_write_ended_at_random_moments() -> None:
    """A fixed slice of benchmarks/signals.py."""
    done = subprocess.run(
        [sys.executable, "-c", _SLICE], cwd=_BENCHMARKS, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    names, ends = json.loads(done.stdout.splitlines()[-1])
    assert {(name, number) for name, number, _, _ in ends} == {
        (name, number) for name in names for number in (2, 9)
    }
    assert [end for end in ends if end[3]] == []


_DEAF = """import time
    from unittest.mock import Mock
    from msgflow.sql.interrupt import interruptible
    def work():
        signal.raise_signal({0})
        time.sleep(50)
    interruptible(Mock(), work, only_reads={1})"""


@pytest.mark.parametrize("number", few([signal.SIGINT, signal.SIGTERM], signal.SIGINT))
def test_a_statement_that_notices_no_interrupt_ends_with_the_process(
    number: signal.Signals,
) -> None:
    """Where it only reads: there is nothing to undo."""
    assert failing(number, _DEAF.replace("{1}", "True")) == _ENDINGS[number]


@pytest.mark.thorough
def test_what_a_statement_writes_is_waited_for() -> None:
    said = "time.sleep(2)\n        print('done', file=sys.stderr)"
    body = _DEAF.replace("{1}", "False").replace("time.sleep(50)", said)
    assert failing(signal.SIGINT, body) == (ExitCode.INTERRUPTED, "done\nerror: interrupted\n")
