"""Where the locale knows ASCII only, as in many containers, files are read and written as UTF-8."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.thorough import thorough

import msgflow

PACKAGE = Path(msgflow.__file__).parent
ASCII = {
    "PATH": os.environ["PATH"],
    "LC_ALL": "C",
    "PYTHONUTF8": "0",
    "PYTHONCOERCECLOCALE": "0",
    # Warns where text is read or written in the encoding of the locale, be it ASCII or not.
    "PYTHONWARNDEFAULTENCODING": "1",
}
LINKS = """links:
  # é
  - kind: partial_sync
    node: /perception/detector
    inputs:
      - /camera/image
      - /camera/camera_info
    outputs: /perception/detections
"""


# Starting a process for each would take longer than all of them.
PROGRAM = """
import json, os, sys
from msgflow.__main__ import main
from msgflow.view import report
# They take the most time of a report.
report.MOST_CRITICAL = 1
for number, words in enumerate(json.loads(sys.stdin.read())):
    sys.argv[1:] = words
    file = os.open(f"out{number}", os.O_WRONLY | os.O_CREAT)
    sys.stdout.flush()
    os.dup2(file, 1)
    try:
        code = main()
    except SystemExit as end:
        code = end.code
    assert not code, words
"""


def run(commands: list[list[str]], directory: Path) -> list[str]:
    """Run one command after the other in one process; return what each writes to stdout."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=directory,
        env=ASCII | {"XDG_CACHE_HOME": str(directory / "cache")},
        input=json.dumps(commands).encode(),
        capture_output=True,
        check=False,
    )
    said = done.stderr.decode("utf-8")
    assert done.returncode == 0, said
    ours = [line for line in said.splitlines() if str(PACKAGE) in line and "Warning" in line]
    assert ours == []
    return [(directory / f"out{number}").read_text("utf-8") for number in range(len(commands))]


MORE = (
    ["clocks", "apply", "messages"],
    ["check"],
    ["graph", "-o", "graph.mmd"],
    ["links"],
    ["report", "-o", "report.html"],
)


@pytest.mark.usefixtures("empty_database")
@pytest.mark.parametrize("more", [(), thorough(MORE)])
def test_from_the_trace_to_every_kind_of_file(tmp_path: Path, more: tuple[list[str], ...]) -> None:
    # Of the cache, a new database takes the most time; it is no text.
    (tmp_path / "cache" / "msgflow").mkdir(parents=True)
    for made in (Path(os.environ["XDG_CACHE_HOME"]) / "msgflow").glob("database-*"):
        shutil.copy(made, tmp_path / "cache" / "msgflow")
    (tmp_path / "links.yaml").write_text(LINKS, "utf-8")
    said = run(
        [
            ["simulate", "demo", "-o", "trace", "--factor", "0.02"],
            ["ingest", "trace", "--links", "links.yaml"],
            ["query", "e2e-latency"],
            ["flow", "/camera/image"],
            ["query", "e2e-latency", "-o", "latency.csv"],
            ["flow", "/camera/image", "-o", "flow.html"],
            *more,
        ],
        tmp_path,
    )
    assert " → " in said[2]
    assert "µs" in said[3]
    assert "→" in (tmp_path / "latency.csv").read_text("utf-8")
