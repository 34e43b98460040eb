"""The command of a hint adds a package where msgflow was installed, in the way it was."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from msgflow.text.installation import install_command


@pytest.mark.parametrize(
    ("receipt", "command"),
    [
        ("uv-receipt.toml", f"uv pip install --python {sys.executable} rosbags"),
        ("pipx_metadata.json", "pipx inject ros2-msgflow rosbags"),
        ("pyvenv.cfg", f"{sys.executable} -m pip install rosbags"),
    ],
)
def test_a_package_is_added_as_msgflow_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, receipt: str, command: str
) -> None:
    (tmp_path / receipt).touch()
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    assert install_command("rosbags") == command
