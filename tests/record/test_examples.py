"""The tests of examples/latency_test, as users run them, with the real LTTng."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "latency_test"


@pytest.mark.thorough
def test_examples_of_tests_pass(robot: list[str], tmp_path: Path) -> None:
    """`python3` has rclpy there; without `launch_test` one of both is skipped, and says so."""
    programs = tmp_path / "bin"
    programs.mkdir()
    python = Path(robot[robot.index("-c") - 1])
    environment = robot[: robot.index(str(python))]
    without = [word for word in environment if not word.startswith("LD_PRELOAD=")]
    launch_test = python.with_name("launch_test")
    commands = {"python3": [*environment, str(python)], "launch_test": [*without, str(launch_test)]}
    for name, words in commands.items():
        if Path(words[-1]).exists():
            (programs / name).write_text(f'#!/bin/sh\nexec {shlex.join(words)} "$@"\n')
            (programs / name).chmod(0o755)
    # The tests of this tree have settings of their own.
    alone = ["-c", os.devnull, f"--rootdir={EXAMPLE}", f"--confcutdir={EXAMPLE}"]
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-rs", *alone, f"--basetemp={tmp_path / 'made'}", EXAMPLE],
        env=os.environ | {"PATH": os.pathsep.join([str(programs), os.environ["PATH"]])},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stdout
    assert "2 passed" in run.stdout or "no launch_test" in run.stdout
