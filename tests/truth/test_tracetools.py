"""The library of tracepoints takes what the wheels of ROS 2 give it."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from recording.tracetools import parameters

HEADER = Path(sys.prefix) / "ros" / "include" / "tracetools" / "tracetools" / "tracetools.h"


def test_its_functions_take_as_many_parameters_as_are_given() -> None:
    """One too few, and an address of something else is recorded as that of the message."""
    if not HEADER.exists():
        pytest.skip("no wheels of ROS 2")
    text = re.sub(r"/\*.*?\*/|//[^\n]*", "", HEADER.read_text(encoding="utf-8"), flags=re.DOTALL)
    declared = dict(re.findall(r"DECLARE_TRACEPOINT\(\s*(\w+)\s*,(.*?)\)", text, re.DOTALL))
    given = {name: len(declared[name].split(",")) for name in parameters() if name in declared}
    assert len(given) > 30
    assert given == {name: len(parameters()[name]) for name in given}
