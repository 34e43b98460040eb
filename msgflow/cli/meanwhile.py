"""Imports that take long and are needed late, done while DuckDB is at work."""

from __future__ import annotations

import contextlib
import sys
from importlib import import_module
from threading import Thread

ARROW = "pyarrow"


def import_meanwhile(name: str) -> Thread | None:
    """Begin to import a module in another thread; whoever imports it meanwhile waits for it.

    So does the end of the program: an import that is cut off there may crash.

    Args:
        name: of the module.

    Returns:
        the thread; None where the module is there already.
    """
    if name in sys.modules:
        return None
    thread = Thread(target=_import, args=(name,), name=f"import {name}")
    thread.start()
    return thread


def _import(name: str) -> None:
    # Whoever needs it imports it again, and says what is wrong.
    with contextlib.suppress(Exception):
        import_module(name)
