"""How to add a package to the environment that msgflow runs in."""

from __future__ import annotations

import sys
from pathlib import Path


def install_command(package: str) -> str:
    """Return the command that installs a package beside msgflow, as msgflow was installed."""
    environment = Path(sys.prefix)
    if (environment / "uv-receipt.toml").exists():  # it has no pip
        return f"uv pip install --python {sys.executable} {package}"
    if (environment / "pipx_metadata.json").exists():
        return f"pipx inject ros2-msgflow {package}"
    return f"{sys.executable} -m pip install {package}"
