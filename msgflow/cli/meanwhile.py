"""Imports that take long and are needed late, done while DuckDB is at work."""

from __future__ import annotations

import sys
from importlib import import_module
from threading import Thread

ARROW = "pyarrow"


def import_meanwhile(name: str) -> Thread | None:
    """Begin to import a module in another thread; whoever imports it meanwhile waits for it.

    Args:
        name: of a module that is certain to be there.

    Returns:
        the thread; None where the module is there already.
    """
    if name in sys.modules:
        return None
    thread = Thread(target=import_module, args=(name,), name=f"import {name}")
    thread.start()
    return thread
