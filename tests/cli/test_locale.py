"""Where the locale knows ASCII only, as in many containers, files are read and written as UTF-8."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

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


def run(*arguments: object, directory: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "msgflow", *(str(argument) for argument in arguments)],
        cwd=directory,
        env=ASCII | {"XDG_CACHE_HOME": str(directory / "cache")},
        capture_output=True,
        check=False,
    )
    said = done.stderr.decode("utf-8")
    assert done.returncode == 0, said
    ours = [line for line in said.splitlines() if str(PACKAGE) in line and "Warning" in line]
    assert ours == []
    return done.stdout.decode("utf-8")


def test_from_the_trace_to_every_kind_of_file(tmp_path: Path) -> None:
    run("simulate", "demo", "trace", "--factor", "0.02", directory=tmp_path)
    links = tmp_path / "links.yaml"
    links.write_text(LINKS, "utf-8")
    run("ingest", "trace", "--links", links, directory=tmp_path)
    run("clocks", "apply", "messages", directory=tmp_path)
    assert " → " in run("query", "e2e-latency", directory=tmp_path)
    assert "µs" in run("flow", "--topic", "/camera/image", directory=tmp_path)
    run("check", directory=tmp_path)
    for command in (
        ("query", "e2e-latency", "-o", "latency.csv"),
        ("graph", "-o", "graph.svg"),
        ("flow", "--topic", "/camera/image", "--html", "flow.html"),
        ("report", "-o", "report.html"),
        ("links", "list"),
    ):
        run(*command, directory=tmp_path)
    assert "→" in (tmp_path / "latency.csv").read_text("utf-8")
