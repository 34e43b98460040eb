"""A fixed slice of benchmarks/signals.py: commands that write, ended at random moments."""

from __future__ import annotations

import importlib.util
import signal
from pathlib import Path

_FILE = Path(__file__).resolve().parents[2] / "benchmarks" / "signals.py"
_SPECIFICATION = importlib.util.spec_from_file_location("signals", _FILE)
assert _SPECIFICATION is not None
assert _SPECIFICATION.loader is not None
signals = importlib.util.module_from_spec(_SPECIFICATION)
_SPECIFICATION.loader.exec_module(signals)


def test_a_slice_of_the_campaign() -> None:
    ends = list(signals.moments(12, 1, signals=(signal.SIGINT, signal.SIGKILL)))
    assert {(name, number) for name, number, _, _ in ends} == {
        (name, number) for name in signals.NAMES for number in (signal.SIGINT, signal.SIGKILL)
    }
    assert [end for end in ends if end[3]] == []
