"""`ros2 msgflow`, with a ros2cli of a few lines that treats its commands as ros2cli does."""

from __future__ import annotations

import importlib.metadata
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.thorough import few

from msgflow.backports import tomllib

PYPROJECT = Path(__file__).parents[2] / "pyproject.toml"
COMMAND = """
class CommandExtension:
    NAME = None
    EXTENSION_POINT_VERSION = "0.1"

    def add_arguments(self, parser, cli_name):
        pass

    def main(self, *, parser, args):
        raise NotImplementedError()
"""
# Commands are first parsed without their arguments, to find which is wanted.
CLI = """
import argparse, importlib, signal, sys


def main(value, argv):
    parser = argparse.ArgumentParser(prog="ros2")
    parser.add_argument("--use-python-default-buffering", action="store_true")
    subparsers = parser.add_subparsers(dest=" _command")
    command = subparsers.add_parser("msgflow")
    command.print_help = lambda: None
    command.exit = lambda status=0, message=None: None if status == 0 else sys.exit(status)
    known, _ = parser.parse_known_args(argv)
    del command.print_help, command.exit
    assert getattr(known, " _command") == "msgflow"
    module, _, name = value.partition(":")
    extension = getattr(importlib.import_module(module), name)()
    extension.NAME = "msgflow"
    command.set_defaults(_command=extension)
    extension.add_arguments(command, "ros2 msgflow")
    args = parser.parse_args(argv)
    try:
        return extension.main(parser=parser, args=args)
    except KeyboardInterrupt:
        return signal.SIGINT
    except RuntimeError as error:
        return str(error)

if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
"""


@pytest.fixture
def ros2(tmp_path: Path) -> Path:
    package = tmp_path / "ros2" / "ros2cli"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "command.py").write_text(COMMAND)
    (package / "cli.py").write_text(CLI)
    return package.parent


def run(ros2: Path, *words: str) -> subprocess.CompletedProcess[str]:
    groups = tomllib.loads(PYPROJECT.read_text())["project"]["entry-points"]
    value = groups["ros2cli.command"]["msgflow"]
    return subprocess.run(
        [sys.executable, "-m", "ros2cli.cli", value, "msgflow", *words],
        cwd=ros2,
        env=os.environ | {"PYTHONPATH": str(ros2)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_words_reach_msgflow_as_they_are(ros2: Path, small_database: Path) -> None:
    database = ("--db", str(small_database), "--format", "csv")
    done = run(ros2, "sql", "SELECT name FROM run ORDER BY run_id", *database)
    assert (done.returncode, done.stdout) == (0, '"name"\n"morning"\n"noon"\n')
    done = run(ros2, "info", "--section", "runs", "--run=noon", *database, "--limit", "1")
    assert (done.returncode, done.stdout.splitlines()[1][:8]) == (0, '2,"noon"')


@pytest.mark.parametrize("option", few(["-h", "--help"], "-h"))
def test_help_is_that_of_msgflow(ros2: Path, option: str) -> None:
    own = [sys.executable, "-m", "msgflow", option]
    words = subprocess.run(own, capture_output=True, text=True, check=True).stdout.split()
    of_ros2 = run(ros2, option).stdout.split()
    # The same commands and options, under another name.
    assert " ".join(of_ros2) == " ".join(words).replace("python -m msgflow", "ros2 msgflow", 1)
    assert "Usage: ros2 msgflow COMMAND" in " ".join(of_ros2)
    assert (
        "Usage: ros2 msgflow query e2e-latency" in run(ros2, "query", "e2e-latency", option).stdout
    )


def test_options_without_a_command(ros2: Path) -> None:
    assert run(ros2, "--version").stdout.startswith("msgflow ")
    assert "Usage: ros2 msgflow" in run(ros2).stdout


def test_exit_codes_are_those_of_msgflow(ros2: Path) -> None:
    assert run(ros2, "query", "nothing").returncode == 2
    done = run(ros2, "info", "--section", "runs", "--db", "none.duckdb")
    assert done.returncode == 4
    assert done.stderr.startswith("error: no database")


def test_msgflow_needs_no_ros2cli() -> None:
    code = (
        "import sys; sys.modules['ros2cli'] = None\n"
        "from typer.testing import CliRunner\n"
        "from msgflow.cli.app import app\n"
        "result = CliRunner().invoke(app, ['--help'])\n"
        "assert result.exit_code == 0 and 'msgflow.cli.ros2' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    assert "ros2cli" not in str(importlib.metadata.requires("ros2-msgflow"))
