"""Runs the commands on the pages of this directory and writes what they print below them.

    python docs/examples.py [PAGE]…

A block that begins with ```console has commands, each behind `$ `, and what they print in a
terminal of 100 columns. A block ```sql is answered by the block ```text behind it. Blocks that
begin with ```sh title="Setup" run first, and show nothing; pages with the same setup share what it
made, and a page without one starts from the simulated demo. A test keeps the pages equal to
what the commands print.
"""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import tempfile
import termios
from pathlib import Path

HERE = Path(__file__).parent
QUERIES = sorted((HERE / "queries").glob("*.md"))
PAGES = (
    "why-late.md",
    "tour.md",
    "cookbook.md",
    "own-events.md",
    "scheduling.md",
    "../README.md",
    *(f"queries/{page.name}" for page in QUERIES),
)
# What pages without a setup of their own start from: two hosts.
DEMO = """\
msgflow simulate demo -o trace
msgflow ingest trace --clock-sync messages
"""
COLUMNS = 100
SETUP = re.compile(r'^```sh title="Setup"\n(.*?)^```$', re.MULTILINE | re.DOTALL)
CONSOLE = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^\$ ((?:.*\\\n)*.*)\n", re.MULTILINE)
SQL = re.compile(r"^```sql\n(.*?)^```\n\n```text\n.*?^```$", re.MULTILINE | re.DOTALL)


def run(command: str, directory: Path, columns: int = COLUMNS) -> str:
    """Run a command of the shell in a terminal; return what a person would see there."""
    controller, terminal = pty.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
    environment = {
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "HOME": str(directory),
        "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", str(directory / ".cache")),
        "TERM": "xterm-256color",
        "NO_COLOR": "1",
        "LC_ALL": "C.UTF-8",
    }
    with subprocess.Popen(
        ["/bin/sh", "-c", command],
        cwd=directory,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=terminal,
        stderr=terminal,
        start_new_session=True,
    ):
        os.close(terminal)
        said = bytearray()
        # Linux reports an error once no process holds the other end.
        try:
            while read := os.read(controller, 65536):
                said += read
        except OSError:
            pass
    os.close(controller)
    lines = said.decode("utf-8").replace("\r\n", "\n").splitlines()
    return "".join(f"{line.rstrip()}\n" for line in lines)


def filled(text: str, directory: Path) -> str:
    """Return the text of a page with what its commands print, run in a directory."""

    def commands(block: re.Match[str]) -> str:
        found = COMMAND.findall(block[1])
        shown = [f"$ {command}\n{run(command, directory)}" for command in found]
        return "```console\n" + "\n".join(shown) + "```"

    def statement(block: re.Match[str]) -> str:
        (directory / "recipe.sql").write_text(block[1], "utf-8")
        answer = run("msgflow sql --file recipe.sql", directory)
        return f"```sql\n{block[1]}```\n\n```text\n{answer}```"

    return SQL.sub(statement, CONSOLE.sub(commands, text))


def pages(names: tuple[str, ...] = PAGES) -> dict[str, str]:
    """Return the pages as they should be."""
    found = {}
    prepared: dict[str, Path] = {}
    with tempfile.TemporaryDirectory() as temporary:
        for name in names:
            text = (HERE / name).read_text("utf-8")
            setup = "".join(SETUP.findall(text)) or DEMO
            if setup not in prepared:
                prepared[setup] = Path(temporary) / str(len(prepared))
                prepared[setup].mkdir()
                (prepared[setup] / "examples").symlink_to(HERE.parent / "examples")
                run(f"set -e\n{setup}", prepared[setup])
            found[name] = filled(text, prepared[setup])
    return found


if __name__ == "__main__":
    for page, new in pages(tuple(sys.argv[1:]) or PAGES).items():
        (HERE / page).write_text(new, "utf-8")
