"""The commands of the program: what the help says of them, and what it imports."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from inspect import getdoc

import pytest
from typer.core import TyperCommand

from msgflow.cli.app import COMMANDS


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_says_the_same_of_itself(name: str) -> None:
    module = import_module(f"msgflow.cli.{name}")
    own = module.app.info.help if hasattr(module, "app") else getdoc(module.command)
    assert TyperCommand(name, help=own).get_short_help_str(1_000) == COMMANDS[name].rstrip(".")


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
    assert [name for name in listed if name in COMMANDS] == list(COMMANDS)
    imported = {module.removeprefix("msgflow.cli.") for module in modules.split()}
    assert not imported & set(COMMANDS)
