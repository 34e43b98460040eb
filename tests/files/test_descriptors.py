"""Paths that are no files: a long-lived program that is given many of them keeps none open."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from msgflow.errors import UsageError
from msgflow.files.text_file import read_text
from msgflow.trace.regular_file import open_regular


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def test_a_directory_leaves_no_descriptor(tmp_path: Path) -> None:
    before = descriptors()
    with pytest.raises(UsageError, match="a directory, no file"):
        read_text(tmp_path, "cannot read the file", "give a file")
    assert descriptors() == before
    with pytest.raises(OSError, match="a directory, no file"):
        open_regular(tmp_path)
    assert descriptors() == before


def test_a_pipe_leaves_no_descriptor(tmp_path: Path) -> None:
    os.mkfifo(pipe := tmp_path / "pipe")
    before = descriptors()
    with pytest.raises(UsageError, match="a pipe, no file"):
        read_text(pipe, "cannot read the file", "give a file")
    with pytest.raises(OSError, match="a pipe, no file"):
        open_regular(pipe)
    assert descriptors() == before
