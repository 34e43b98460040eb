"""Ctrl-C that always works while DuckDB runs a statement."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

    import duckdb

_T = TypeVar("_T")
_SECONDS_BETWEEN_ATTEMPTS = 0.05


def interruptible(connection: duckdb.DuckDBPyConnection, work: Callable[[], _T]) -> _T:
    """Return what `work` returns; Ctrl-C interrupts the statement that it runs on `connection`.

    DuckDB looks for signals only while the main thread has a part of the statement to compute, so
    that a statement run there may not notice Ctrl-C at all. Hence the work goes to another thread.

    Raises:
        KeyboardInterrupt: after the statement has ended.
    """
    if threading.current_thread() is not threading.main_thread():
        return work()
    with ThreadPoolExecutor(max_workers=1) as pool:
        future = pool.submit(work)
        try:
            return future.result()
        except KeyboardInterrupt:
            # The work may be between two statements, where there is nothing to interrupt yet.
            while not future.done():
                connection.interrupt()
                threading.Event().wait(_SECONDS_BETWEEN_ATTEMPTS)
            raise
