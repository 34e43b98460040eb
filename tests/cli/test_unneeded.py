"""Typer imports less for help, and still has what it left out."""

from __future__ import annotations

import subprocess
import sys

import pytest

# Help in Markdown and a traceback of Typer's own, neither of which msgflow asks for.
BOTH = """
import io
import typer
from rich.console import Console
from typer import rich_utils
console = Console(file=io.StringIO(), width=60)
made = rich_utils._make_rich_text(text="*one* `two`", markup_mode="markdown")
console.print(made)
try:
    1 / 0
except ZeroDivisionError as error:
    console.print(rich_utils.Traceback.from_exception(ZeroDivisionError, error, None))
print(console.file.getvalue())
print(type(made).__module__)
"""
LEAVE_OUT = "from msgflow.cli.unneeded import leave_out\nleave_out()\n"


def printed(program: str) -> str:
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout


def test_what_was_left_out_is_imported_when_it_is_used() -> None:
    assert printed(LEAVE_OUT + BOTH) == printed(BOTH)
    assert "ZeroDivisionError" in printed(BOTH)


def test_nothing_left_out_stands_in_anybody_elses_way() -> None:
    whose = "import rich.markdown, rich.traceback\n" + (
        "print(rich.markdown.Markdown.__module__, rich.traceback.Traceback.__module__)"
    )
    program = f"{LEAVE_OUT}import typer.rich_utils\n{whose}"
    assert printed(program) == printed(whose) == "rich.markdown rich.traceback\n"


@pytest.mark.parametrize("before", ["", "import rich.markdown, rich.traceback\n"])
def test_what_is_imported_already_is_used(before: str) -> None:
    program = f"{before}{LEAVE_OUT}{LEAVE_OUT}import sys, typer.rich_utils\n" + (
        "print('rich.markdown' in sys.modules, 'pygments' in sys.modules,"
        " typer.rich_utils.Markdown.__module__,"
        " sum(type(f).__module__ == 'msgflow.cli.unneeded' for f in sys.meta_path))"
    )
    expected = "True True rich.markdown 1\n" if before else "False False msgflow.cli.unneeded 1\n"
    assert printed(program) == expected
