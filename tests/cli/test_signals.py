"""A fixed slice of benchmarks/signals.py: commands that write, ended at random moments."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
# In a process of its own, as some commands are forked from it.
SLICE = """
import json, signal
import signals
both = signal.SIGINT, signal.SIGKILL
ends = signals.moments(12, 1, signals=both, start=signals.forked)
print(json.dumps([signals.NAMES, list(ends)]))
"""


@pytest.mark.thorough
def test_a_slice_of_the_campaign() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SLICE], cwd=BENCHMARKS, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    names, ends = json.loads(done.stdout.splitlines()[-1])
    assert {(name, number) for name, number, _, _ in ends} == {
        (name, number) for name in names for number in (2, 9)
    }
    assert [end for end in ends if end[3]] == []
