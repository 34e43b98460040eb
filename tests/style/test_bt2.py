"""Babeltrace 2's bindings are needed only where traces are compared with what they read."""

from __future__ import annotations

from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
# The reader itself, and what the simulator writes, are compared with Babeltrace 2.
COMPARING = {"trace", "sim"}


def test_no_other_test_asks_for_them() -> None:
    asking = {
        path.relative_to(TESTS).parts[0]
        for path in TESTS.rglob("*.py")
        if path != Path(__file__) and "bt2_library.load" in path.read_text()
    }
    assert asking == COMPARING
