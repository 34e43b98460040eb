"""What the help says of the commands without importing them."""

from __future__ import annotations

import subprocess
import sys

import pytest
import typer

from msgflow.cli.app import app
from msgflow.cli.outline import OUTLINES


@pytest.mark.parametrize("name", OUTLINES)
def test_a_command_says_the_same_of_itself(name: str) -> None:
    command = typer.main.get_command(app).commands[name]
    assert command.get_short_help_str(1_000) == OUTLINES[name].get_short_help_str(1_000)
    assert not command.hidden


def test_the_help_lists_all_and_imports_none() -> None:
    program = (
        "import sys; sys.argv = ['msgflow', '--help']; from msgflow.cli.app import app\n"
        "try: app()\n"
        "except SystemExit: print(*(name for name in sys.modules if name.startswith('msgflow.')))"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    )
    *lines, modules = run.stdout.splitlines()
    listed = [line.split()[1] for line in lines if line.startswith("│ ")]
    assert [name for name in listed if name in OUTLINES] == list(OUTLINES)
    imported = {module.removeprefix("msgflow.cli.") for module in modules.split()}
    assert not imported & set(OUTLINES)
