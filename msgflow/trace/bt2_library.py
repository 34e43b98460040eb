"""Loader of Babeltrace 2's Python bindings; the only module that imports them.

They are not on PyPI: a distribution builds them for its own Python. In a virtual environment they
are loaded from the distribution's directory, alone: nothing else there becomes importable.
"""

from __future__ import annotations

import re
import sys
from importlib import import_module
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path
from typing import Any

from msgflow.errors import TraceError

PREFIXES = ("/usr/lib", "/usr/lib64", "/usr/local/lib", "/usr/local/lib64")
"""Below these, distributions put the packages of all versions of Python."""

_INSTALL = "apt install python3-bt2"


def load() -> Any:
    """Import bt2 from this environment, else from the distribution."""
    try:
        return import_module("bt2")
    except ModuleNotFoundError:
        pass
    try:
        return _load_from_distribution()
    except ImportError as error:
        raise TraceError(
            f"Babeltrace 2's Python bindings (bt2) cannot be imported — {error}",
            hint=f"{_INSTALL} --reinstall",
        ) from error


def _load_from_distribution() -> Any:
    pattern = "python3*/*-packages/bt2/_native_bt*.so"
    found = [path for prefix in PREFIXES for path in sorted(Path(prefix).glob(pattern))]
    for path in found:
        if PathFinder.find_spec("_native_bt", [str(path.parent)]) is not None:
            spec = PathFinder.find_spec("bt2", [str(path.parents[1])])
            module = sys.modules["bt2"] = module_from_spec(spec)  # type: ignore[arg-type]
            try:
                spec.loader.exec_module(module)  # type: ignore[union-attr]
            except ImportError:
                for name in [name for name in sys.modules if name.partition(".")[0] == "bt2"]:
                    del sys.modules[name]
                raise
            return module
    if not found:
        raise TraceError("Babeltrace 2's Python bindings (bt2) are not installed", hint=_INSTALL)
    version = re.sub(r".*cpython-3(\d+).*", r"3.\1", found[0].name)
    raise TraceError(
        f"Babeltrace 2's Python bindings are installed for Python {version}, msgflow runs in "
        f"Python 3.{sys.version_info.minor} — {found[0]}",
        hint=f"if that is 3.10 or newer, install msgflow for it: /usr/bin/python{version}",
    )
