"""The commands of the program: what the help says of them, and what it imports."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from inspect import getdoc

import pytest

from msgflow.cli.app import COMMANDS


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_begins_with_its_summary(name: str) -> None:
    module = import_module(f"msgflow.cli.{name}")
    if not hasattr(module, "app"):
        assert (getdoc(module.command) or "").startswith(COMMANDS[name])


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
