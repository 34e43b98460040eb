"""Babeltrace 2's bindings are needed only where traces are compared with what they read."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# The reader itself, and what the simulator writes, are compared with Babeltrace 2.
COMPARING = {"tests/trace", "simulator/tests"}


def test_no_other_test_asks_for_them() -> None:
    asking = {
        "/".join(path.relative_to(ROOT).parts[:2])
        for folder in ("tests", "simulator")
        for path in (ROOT / folder).rglob("*.py")
        if path != Path(__file__) and "bt2_library.load" in path.read_text()
    }
    assert asking == COMPARING
