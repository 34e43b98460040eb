"""Inserter: a thread that inserts one batch while the next one is read."""

from __future__ import annotations

import queue
import threading
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

_Item = TypeVar("_Item")

# All events of a round are one item.
_WAITING = 1
_SECONDS_BETWEEN_LOOKS = 0.1


class Inserter(Generic[_Item]):
    """A context manager that hands items to `insert`, one after the other, in order.

    Leaving it waits until all items are inserted. An exception that leaves it drops the items that
    still wait. An error of `insert` is raised by the next `put`, or on leaving.
    """

    def __init__(self, insert: Callable[[_Item], None]) -> None:
        self._insert = insert
        self._waiting: queue.Queue[_Item | None] = queue.Queue(_WAITING)
        self._error: BaseException | None = None
        self._is_dropping = False
        self._thread = threading.Thread(target=self._work, name="insert batches")

    def put(self, item: _Item) -> None:
        """Hand over an item, and wait as long as too many are waiting.

        Raises:
            BaseException: the error of an earlier `insert`.
        """
        while True:
            if self._error is not None:
                raise self._error
            try:
                return self._waiting.put(item, timeout=_SECONDS_BETWEEN_LOOKS)
            except queue.Full:
                continue

    def __enter__(self) -> Inserter[_Item]:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._is_dropping = kind is not None
        self._waiting.put(None)
        self._thread.join()
        if kind is None and self._error is not None:
            raise self._error

    def _work(self) -> None:
        while (item := self._waiting.get()) is not None:
            if self._is_dropping or self._error is not None:
                continue
            try:
                self._insert(item)
            except BaseException as error:  # for the thread that reads
                self._error = error
