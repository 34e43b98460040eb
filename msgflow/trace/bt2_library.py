"""Loads Babeltrace 2's Python bindings; the only module that imports them.

They are not on PyPI, a distribution builds them for its own Python. Where msgflow runs in a
virtual environment they are loaded from the distribution's directory, alone: nothing else there
becomes importable.
"""

from __future__ import annotations

import importlib
import re
import sys
from dataclasses import dataclass
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.errors import TraceError

if TYPE_CHECKING:
    from collections.abc import Iterator

_INSTALL_HINT = "apt install python3-bt2"
_VERSION = (sys.version_info.major, sys.version_info.minor)
ROOTS = (
    "/usr/lib/python3/dist-packages",
    "/usr/lib/python{0}.{1}/dist-packages",
    "/usr/lib/python{0}.{1}/site-packages",
    "/usr/lib64/python{0}.{1}/site-packages",
    "/usr/local/lib/python{0}.{1}/dist-packages",
    "/usr/local/lib/python{0}.{1}/site-packages",
    "/usr/local/lib64/python{0}.{1}/site-packages",
)
"""Where distributions put packages for the Python that runs."""

PREFIXES = ("/usr/lib", "/usr/lib64", "/usr/local/lib")
"""Below these lie the directories of all versions of Python."""

_NATIVE = "_native_bt"


@dataclass(frozen=True)
class Bt2Library:
    """The bindings.

    Attributes:
        bt2: the package.
        native: its extension module; calling it directly skips a Python call per field.
        version: such as (2, 0, 4).
    """

    bt2: Any
    native: Any
    version: tuple[int, ...]

    @property
    def reads_ctf2(self) -> bool:
        """CTF 2 is understood since 2.1."""
        return self.version >= (2, 1)

    @property
    def has_stale_empty_strings(self) -> bool:
        """Before 2.0.5 an empty string field returns the text of an earlier event."""
        return self.version < (2, 0, 5)


def load() -> Bt2Library:
    """Import bt2 from this environment, else from the distribution.

    Raises:
        TraceError: bt2 is not installed, or only for another Python.
    """
    try:
        import bt2
    except ImportError as error:
        if error.name not in {None, "bt2"}:
            raise _broken_error(error) from error
        bt2 = _load_from_distribution()
    native = importlib.import_module(f"bt2.{_NATIVE}")
    numbers = re.findall(r"\d+", str(bt2.__version__))
    return Bt2Library(bt2, native, tuple(map(int, numbers[:3])))


def _load_from_distribution() -> Any:
    directories = list(_installed_directories())
    for directory in directories:
        if any((directory / f"{_NATIVE}{suffix}").is_file() for suffix in EXTENSION_SUFFIXES):
            return _import_package(directory)
    for directory in directories:
        for native in sorted(directory.glob(f"{_NATIVE}.cpython-*.so")):
            built_for = _python_of(native)
            raise TraceError(
                f"Babeltrace 2's Python bindings are installed for Python {built_for}, msgflow "
                f"runs in Python {_VERSION[0]}.{_VERSION[1]} — {native}",
                hint=f"install msgflow for that Python: uv tool install --python "
                f"/usr/bin/python{built_for} msgflow"
                if _runs_msgflow(built_for)
                else "msgflow needs Python 3.11 or newer: install bindings that are built for one",
            )
    raise TraceError("Babeltrace 2's Python bindings (bt2) are not installed", hint=_INSTALL_HINT)


def _installed_directories() -> Iterator[Path]:
    for root in ROOTS:
        directory = Path(root.format(*_VERSION)) / "bt2"
        if (directory / "__init__.py").is_file():
            yield directory
    # Bindings for another Python are of no use, but worth naming.
    for root in PREFIXES:
        for directory in sorted(Path(root).glob("python3.*/*-packages/bt2")):
            yield directory


def _import_package(directory: Path) -> Any:
    spec = spec_from_file_location(
        "bt2", directory / "__init__.py", submodule_search_locations=[str(directory)]
    )
    if spec is None or spec.loader is None:
        raise TraceError(f"cannot import bt2 — {directory}", hint=_INSTALL_HINT)
    module = module_from_spec(spec)
    sys.modules["bt2"] = module
    try:
        spec.loader.exec_module(module)
    except ImportError as error:
        for name in [name for name in sys.modules if name == "bt2" or name.startswith("bt2.")]:
            del sys.modules[name]
        raise _broken_error(error) from error
    return module


def _python_of(native: Path) -> str:
    found = re.search(r"cpython-3(\d+)", native.name)
    return f"3.{found.group(1)}" if found else "3"


def _runs_msgflow(version: str) -> bool:
    return tuple(map(int, version.split("."))) >= (3, 11)


def _broken_error(error: ImportError) -> TraceError:
    return TraceError(
        f"Babeltrace 2's Python bindings (bt2) cannot be imported — {error}",
        hint=f"{_INSTALL_HINT} --reinstall",
    )
