"""The program as a process of its own: imports, pipes, terminals, signals, time."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import pty
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Sequence
from pathlib import Path

import pytest
from support.thorough import few, thorough
from typer.testing import CliRunner

from msgflow.cli.app import app
from msgflow.ingest import ingest
from msgflow_sim import Recording, simulate

HEAVY = ("duckdb", "pyarrow", "sqlalchemy", "alembic", "pandas", "polars", "bt2")
ONLY_FOR_SOME = ("sqlalchemy", "alembic", "duckdb_engine", "pandas", "polars", "bt2")
SLOW = "SELECT count(*) FROM range(1000000) a, range(10000000) b WHERE a.range * b.range % 7 = 3"


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "msgflow", *map(str, arguments)]


def imported(*commands: Sequence[object]) -> set[str]:
    """Return the modules that are there after these command lines, in one process."""
    program = (
        "import json, sys\n"
        "from msgflow.cli.app import app\n"
        "for words in json.loads(sys.argv[1]):\n"
        "    try:\n        app(words)\n"
        "    except SystemExit as end:\n        assert not end.code, end.code\n"
        "print(' '.join(sys.modules), file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, json.dumps(commands, default=str)],
        capture_output=True,
        text=True,
        check=True,
    )
    return {name.partition(".")[0] for name in done.stderr.splitlines()[-1].split()}


def test_numpy_starts_no_threads() -> None:
    """Nothing of its algebra is used, for which it has one per core."""
    program = (
        "import os, sys\n"
        "sys.argv = ['msgflow', '--version']\n"
        "from msgflow.__main__ import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "import numpy\n"
        "print(len(os.listdir('/proc/self/task')))\n"
    )
    environment = {key: value for key, value in os.environ.items() if "THREADS" not in key}
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=True
    )
    assert done.stdout.split()[-1] == "1"


HELP = (
    ("--help",),
    ("--version",),
    ("ingest", "--help"),
    ("query",),
    ("query", "--help"),
    ("query", "topics", "--help"),
    ("query", "topics", "--show"),
    ("sql", "--help"),
    ("flow", "--help"),
    ("info", "--help"),
    ("events", "--help"),
    ("export", "parquet", "--help"),
    ("export", "csv", "--help"),
    ("db", "upgrade", "--help"),
    ("simulate", "--help"),
)


def test_help_imports_nothing_of_the_database_stack() -> None:
    assert not imported(*HELP) & set(HEAVY)


def test_an_ingest_and_a_query_import_what_they_need_and_no_more(tmp_path: Path) -> None:
    """Definitions of the tables in SQLAlchemy are for users, and for upgrades of old databases."""
    trace, database = tmp_path / "trace", tmp_path / "new.duckdb"
    simulate("pipeline", trace, factor=0.01)
    commands = ("ingest", trace), ("query", "topics"), ("why",)
    modules = imported(*((*words, "--db", database) for words in commands))
    assert {"duckdb", "pyarrow", "numpy"} <= modules
    assert not modules & set(ONLY_FOR_SOME)


def test_a_reader_that_goes_away_is_no_error(small_database: Path) -> None:
    process = subprocess.Popen(
        command("sql", "FROM range(300000)", "--limit", 0, "--db", small_database),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.readline()
    process.stdout.close()
    errors = process.stderr.read()
    process.stderr.close()
    assert process.wait(timeout=30) == 0
    assert errors == b""


@pytest.mark.parametrize("unbuffered", few(["", "1"], ""))
@pytest.mark.parametrize(
    "arguments",
    [("info",), thorough(("info", "--section", "runs", "--format", "csv")), ("--help",)],
)
def test_a_full_disk_is_said(
    small_database: Path, arguments: tuple[str, ...], unbuffered: str
) -> None:
    if not os.path.exists("/dev/full"):
        pytest.skip("there is no /dev/full here")
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            command(*arguments),
            stdout=full,
            stderr=subprocess.PIPE,
            env=os.environ | {"PYTHONUNBUFFERED": unbuffered, "MSGFLOW_DB": str(small_database)},
            check=False,
        )
    assert done.returncode == 2
    _, error, hint = done.stderr.partition(
        b"error: cannot write to stdout: no space left on device"
    )
    assert error
    assert hint.startswith(b"\n\nhint: ")
    assert hint.count(b"\n") == 3


def without(stream: str, *arguments: object) -> subprocess.CompletedProcess[bytes]:
    """Run a command line whose stdout (1) or stderr (2) is closed."""
    closing = ["sh", "-c", f'exec "$@" {stream}>&-', "sh"]
    return subprocess.run([*closing, *command(*arguments)], capture_output=True, check=False)


@pytest.mark.thorough
def test_a_closed_stdout_is_said_by_what_has_data(small_database: Path) -> None:
    for arguments in (("info",), ("sql", "FROM run")):
        done = without("1", *arguments, "--db", small_database)
        assert done.returncode == 2
        assert b"error: cannot write to stdout: it is closed\n\nhint: " in done.stderr
    done = without("1", "db", "upgrade", "--db", small_database)
    assert done.returncode == 0


@pytest.mark.thorough
def test_a_closed_stderr_does_not_matter(small_database: Path, tmp_path: Path) -> None:
    done = without("2", "info", "--section", "runs", "--db", small_database)
    assert (done.returncode, b"noon" in done.stdout) == (0, True)
    assert without("2", "ingest", tmp_path, "--db", small_database).returncode == 3


def has_open(process: int, path: Path) -> bool:
    with contextlib.suppress(FileNotFoundError):
        return any(file.samefile(path) for file in Path(f"/proc/{process}/fd").iterdir())
    return False


@pytest.mark.thorough
def test_an_interrupt_ends_a_query_with_code_130(small_database: Path) -> None:
    process = subprocess.Popen(
        command("sql", SLOW, "--db", small_database), stderr=subprocess.PIPE, text=True
    )
    # It runs the query right after it has opened the database.
    while process.poll() is None and not has_open(process.pid, small_database):
        time.sleep(0.02)
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    try:
        _, errors = process.communicate(timeout=20)
    finally:
        process.kill()
    assert process.returncode == 130
    assert errors == "error: interrupted\n"


def on_terminal(arguments: list[str], width: int = 40, *, with_stderr: bool = False) -> bytes:
    """Return what a program writes to stdout when that is a terminal, and to stderr."""
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        arguments,
        stdout=follower,
        stderr=follower if with_stderr else subprocess.DEVNULL,
        env=os.environ | {"COLUMNS": str(width), "TERM": "xterm-256color", "NO_COLOR": "1"},
    )
    os.close(follower)
    parts = []
    while True:
        try:
            part = os.read(leader, 65536)
        except OSError:
            break
        if not part:
            break
        parts.append(part)
    os.close(leader)
    assert process.wait(timeout=30) in ((0, 1) if with_stderr else (0,))
    return b"".join(parts).replace(b"\r\n", b"\n")


def piped(*arguments: object) -> bytes:
    """Return what a command line writes to stdout where that is no terminal."""
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert done.exit_code == 0
    return done.stdout_bytes


@pytest.mark.thorough
@pytest.mark.parametrize("form", few(["json", "csv", "markdown", "table --wide"], "csv"))
def test_a_terminal_gets_the_same_bytes_as_a_pipe(small_database: Path, form: str) -> None:
    arguments = ("info", "--section", "runs", "--db", small_database, "--format", *form.split())
    pipe = subprocess.run(command(*arguments), stdout=subprocess.PIPE, check=True).stdout
    assert on_terminal(command(*arguments)) == pipe == piped(*arguments) != b""


@pytest.mark.thorough
@pytest.mark.parametrize(
    "arguments",
    [
        thorough(("query", "topics")),
        thorough(("info", "--section", "runs", "--run", "all")),
        ("info",),
        thorough(("db", "schema")),
        thorough(("sql", "FROM run, range(3) SELECT * EXCLUDE (created_at)")),
        thorough(("clocks", "show")),
        thorough(("links",)),
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("width", few([40, 80, 100], 40))
def test_a_table_fits_the_terminal(
    small_database: Path, arguments: tuple[str, ...], width: int
) -> None:
    lines = on_terminal(command(*arguments, "--db", small_database), width).decode().splitlines()
    assert max(map(len, lines), default=0) <= width
    wide = on_terminal(command(*arguments, "--wide", "--db", small_database), width)
    assert wide == piped(*arguments, "--wide", "--db", small_database)


@pytest.mark.thorough
@pytest.mark.parametrize("width", few([60, 80, 100], 60))
@pytest.mark.parametrize(
    "arguments",
    [
        ("query",),
        thorough(("simulate", "--list")),
        thorough(("check",)),
        thorough(("clocks", "show")),
        thorough(("runs",)),
    ],
)
def test_no_line_is_wider_than_the_terminal(
    two_hosts_far_apart: Path, arguments: tuple[str, ...], width: int
) -> None:
    options = ("--db", two_hosts_far_apart) if arguments[0] in ("check", "clocks", "runs") else ()
    shown = on_terminal(command(*arguments, *options), width, with_stderr=True).decode()
    assert len(shown.splitlines()) > 1
    assert [line for line in shown.splitlines() if len(line) > width] == []


@pytest.mark.thorough
def test_notes_fit_the_terminal_also_where_the_answer_goes_elsewhere(
    two_hosts_far_apart: Path,
) -> None:
    leader, follower = pty.openpty()
    fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 60, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    process = subprocess.Popen(
        command("query", "e2e-latency", "--db", two_hosts_far_apart),
        stdout=subprocess.DEVNULL,
        stderr=follower,
        env=environment | {"NO_COLOR": "1"},
    )
    os.close(follower)
    said = b""
    with contextlib.suppress(OSError):
        while part := os.read(leader, 65536):
            said += part
    os.close(leader)
    assert process.wait(timeout=30) == 0
    lines = said.decode().splitlines()
    assert any("not synchronised" in line for line in lines)
    assert [line for line in lines if len(line) > 60] == []


@pytest.fixture(scope="module")
def two_hosts_far_apart(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two hosts without synchronisation, whose traces have long paths and are damaged."""
    directory = tmp_path_factory.mktemp("far")
    traces = directory / ("a_long_name_of_a_session_" * 5)
    simulate("two_hosts", traces, factor=0.1, recording=Recording(cut_streams=2))
    database = directory / "far.duckdb"
    ingest([traces], database)
    return database


def test_parquet_is_not_written_to_a_terminal(small_database: Path) -> None:
    arguments = command("info", "--section", "runs", "--db", small_database, "--format", "parquet")
    leader, follower = pty.openpty()
    done = subprocess.run(arguments, stdout=follower, stderr=subprocess.PIPE, check=False)
    os.close(follower)
    os.close(leader)
    assert done.returncode == 2
    assert b"-o FILE.parquet" in done.stderr


@pytest.mark.parametrize("form", few(["table", "csv", "json", "jsonl", "markdown"], "table"))
def test_a_terminal_obeys_no_name(small_database: Path, form: str) -> None:
    """Control characters in names show, also one that goes back to the begin of the line.

    A file and a pipe get them as they are.
    """
    parts = ["'a'", "chr(27)", "'[31m'", "chr(155)", "'2J'", "chr(7)", "chr(13)", "'é'"]
    text = f'SELECT {" || ".join(parts)} AS "na\\me"'
    shown = on_terminal(command("sql", text, "--db", small_database, "--format", form))
    assert not {character for character in shown.decode() if not character.isprintable()} - {"\n"}
    assert "é" in shown.decode()
    assert "\\x9b" in shown.decode()
    exact = piped("sql", text, "--db", small_database, "--format", "csv")
    assert "\x1b[31m\x9b2J\x07\ré".encode() in exact


def test_messages_obey_no_name(small_database: Path) -> None:
    leader, follower = pty.openpty()
    arguments = command("info", "--section", "runs", "--run", "a\x1b[31m", "--db", small_database)
    done = subprocess.run(
        arguments, stderr=follower, check=False, env=os.environ | {"NO_COLOR": "1"}
    )
    os.close(follower)
    said = os.read(leader, 65536)
    os.close(leader)
    assert done.returncode == 2
    assert b"\\x1b[31m" in said
    assert b"\x1b" not in said
