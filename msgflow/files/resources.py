"""Folders `schema/`, `migrations/`, `queries/` and `docs/`, installed or in a checkout."""

from __future__ import annotations

from functools import cache
from pathlib import Path


@cache
def resource_directory(name: str) -> Path:
    """Return the directory `name` ('schema', 'migrations', 'queries', or 'docs' with the cookbook).

    In a wheel it lies in `msgflow/_data`; in a checkout beside the package, which counts
    only where pyproject.toml lies there too.
    """
    package = Path(__file__).resolve().parents[1]
    packaged = package / "_data" / name
    if packaged.is_dir():
        return packaged
    root = package.parent
    checkout = root / name
    if (root / "pyproject.toml").is_file() and checkout.is_dir():
        return checkout
    raise FileNotFoundError(f"msgflow is installed without its {name}/ directory")
