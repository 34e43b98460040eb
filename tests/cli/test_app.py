"""The commands of the program: what the help says of them, and what it imports."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest
from typer.testing import Result

from msgflow.cli.app import COMMANDS
from msgflow.query.catalogue import load_query

Msgflow = Callable[..., Result]


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_begins_with_its_summary(name: str, msgflow: Msgflow) -> None:
    module = import_module(f"msgflow.cli.{name}")
    _, summary, *_ = msgflow(name, "--help").stdout.split("\n\n")
    if hasattr(module, "command") or hasattr(module, "app"):
        assert " ".join(summary.split()) == (module.__doc__ or "").partition("\n\n")[0]
        assert f"{name} " in msgflow("--help").stdout
    else:
        assert summary == f"{load_query(name).title}."


def test_the_help_lists_all_and_imports_none() -> None:
    program = (
        "import sys; sys.argv = ['msgflow', '--help']; from msgflow.cli.app import app\n"
        "try: app()\n"
        "except SystemExit: print(*sys.modules)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    )
    *lines, modules = run.stdout.splitlines()
    listed = [line.split()[0] for line in lines if line.startswith("  ")]
    assert [name for name in listed if name in COMMANDS] == list(COMMANDS)
    imported = set(modules.split())
    assert not imported & {f"msgflow.cli.{name}" for name in COMMANDS}
    # They take longer to load than all the rest.
    assert not imported & {"duckdb", "pyarrow", "rich.console", "rich.markdown"}


@pytest.fixture
def other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a distribution that has the command `greet`, where Python looks for modules."""
    site = tmp_path / "site"
    (site / "other-1.0.dist-info").mkdir(parents=True)
    (site / "other-1.0.dist-info" / "METADATA").write_text("Name: other\nSummary: Greet robots.\n")
    (site / "other-1.0.dist-info" / "entry_points.txt").write_text(
        "[msgflow.commands]\ngreet = other_command\nsql = other_command\n"
    )
    (site / "other_command.py").write_text(
        'def command(name: str) -> None:\n    """Greet a robot."""\n    print(f"hello {name}")\n'
    )
    monkeypatch.syspath_prepend(site)
    return site


@pytest.mark.usefixtures("other")
def test_another_distribution_adds_a_command_and_replaces_none(msgflow: Msgflow) -> None:
    listed = msgflow("--help").stdout.splitlines()
    assert any(line.split() == ["greet", "Greet", "robots."] for line in listed)
    assert "other_command" not in sys.modules
    assert msgflow("greet", "r1").stdout == "hello r1\n"
    assert "Usage: msgflow greet" in msgflow("greet", "--help").stdout
    assert "did you mean 'greet'" in msgflow("gret").stderr
    assert msgflow("sql", "SELECT 1").exit_code == 4


def test_one_that_cannot_be_imported_names_its_distribution(
    msgflow: Msgflow, other: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "other_command", raising=False)
    (other / "other_command.py").write_text("import no_such_module\n")
    result = msgflow("greet", "r1")
    assert result.exit_code == 2
    assert "the command greet cannot be imported: No module named 'no_such_module'" in result.stderr
    assert "hint: pip install --upgrade" in result.stderr


@pytest.mark.parametrize(
    ("word", "command"),
    [
        ("e2e-latency", "msgflow query e2e-latency"),
        ("wakeup-latency", "msgflow query scheduling --measure wakeup"),
        ("bottleneck", "msgflow query critical-path or msgflow query path-breakdown"),
    ],
)
def test_a_query_is_no_command_and_no_table(
    msgflow: Msgflow, small_database: Path, word: str, command: str
) -> None:
    assert f"hint: {command}\n" in msgflow(word).stderr
    table = msgflow("sql", f"FROM {word.replace('-', '_')}", "--db", small_database)
    assert f"it is a query: {command}\n" in table.stderr


def test_a_command_that_is_a_query_is_named_so(msgflow: Msgflow, small_database: Path) -> None:
    assert (
        "it is a query: msgflow graph\n"
        in msgflow("sql", "FROM graph", "--db", small_database).stderr
    )


def test_its_name_is_completed(other: Path) -> None:
    program = "import sys; sys.argv = ['msgflow']; from msgflow.__main__ import main; main()"
    asked = {"_MSGFLOW_COMPLETE": "complete_bash", "COMP_WORDS": "msgflow gre", "COMP_CWORD": "1"}
    run = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | asked | {"PYTHONPATH": os.pathsep.join([str(other), *sys.path])},
        check=True,
        capture_output=True,
        text=True,
    )
    assert run.stdout.split() == ["greet"]


def test_a_simulator_that_is_missing_is_named(
    msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("msgflow.cli.app.entry_points", lambda **_: ())
    result = msgflow("simulate", "demo")
    assert result.exit_code == 2
    assert result.stderr == (
        "error: the simulator is not installed\n\n"
        f"hint: in a checkout of msgflow: {sys.executable} -m pip install ./simulator\n"
    )
    assert "simulate" not in msgflow("--help").stdout
