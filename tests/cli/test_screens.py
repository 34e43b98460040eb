"""What the main commands print in a terminal: `screens/COLUMNS.txt` has all of it."""

from __future__ import annotations

import importlib.util
import json
import os
import shlex
import sys
from pathlib import Path

import pytest
from support.thorough import few

from msgflow.ingest import ingest

ROOT = Path(__file__).resolve().parents[2]
RECORDING = ROOT / "examples" / "pipeline.tar.xz"
SCREENS = Path(__file__).parent / "screens"
COMMANDS = (
    "why /filtered",
    "check",
    "info",
    "runs",
    "query e2e-latency",
    "query path-breakdown",
    "query critical-path --slowest 2",
    "query callbacks",
    "query waits",
    "query topics --measure delivery",
    "flow /scan --at 4.26s",
    "verify targets.yaml",
)
TARGETS = """\
targets:
  - path: [/scan, /filtered]
    latency: [median < 10 ms, p95 < 20 ms]
  - topic: "/*"
    loss: < 5 %
  - process: filter
    wakeup: p99 < 200 us
"""
# Starting a process for each would take longer than all of them.
PROGRAM = """
import json, shlex, sys
from msgflow.__main__ import main
for line in json.loads(sys.argv[1]):
    print("$ msgflow", line, flush=True)
    sys.argv[1:] = shlex.split(line)
    try:
        main()
    except SystemExit as end:
        if end.code:
            print("exit code", end.code)
    print(flush=True)
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with the recording in a database, and requirements."""
    directory = tmp_path_factory.mktemp("screens")
    (directory / "targets.yaml").write_text(TARGETS)
    ingest([RECORDING], directory / "msgflow.duckdb", name="pipeline")
    return directory


def printed(commands: tuple[str, ...], columns: int, directory: Path) -> str:
    """Run commands in a terminal of so many columns; return what a person would see there."""
    spec = importlib.util.spec_from_file_location("examples", ROOT / "docs" / "examples.py")
    assert spec is not None
    assert spec.loader is not None
    examples = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(examples)
    line = shlex.join([sys.executable, "-c", PROGRAM, json.dumps(commands)])
    shown: str = examples.run(line, directory, columns)
    return shown


@pytest.mark.parametrize("columns", few([80, 100], 80))
def test_the_main_commands_look_as_they_should(place: Path, columns: int) -> None:
    """MSGFLOW_WRITE_SCREENS=1 in the environment writes them; read the difference then."""
    shown = printed(COMMANDS, columns, place)
    path = SCREENS / f"{columns}.txt"
    if os.environ.get("MSGFLOW_WRITE_SCREENS"):
        path.write_text(shown, "utf-8")
    assert shown == path.read_text("utf-8")
    assert not [line for line in shown.splitlines() if len(line) > columns]
