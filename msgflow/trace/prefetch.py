"""Prefetch: a thread makes the items of an iterator ahead of their use."""

from __future__ import annotations

import threading
from queue import Empty, Full, Queue
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

Item = TypeVar("Item")

_WAIT_SECONDS = 0.1


class Prefetch(Generic[Item]):
    """Items of an iterator, made while the consumer works on those before.

    An error of the iterator is raised where the item would have been. The thread ends when the
    items do, or with `close`.
    """

    def __init__(self, make: Callable[[], Iterator[Item]], most: int) -> None:
        """Start; at most so many items wait."""
        self._queue: Queue[Item | BaseException | None] = Queue(most)
        self._stopped = threading.Event()
        self._make = make
        self._thread = threading.Thread(target=self._run, name="msgflow-reader", daemon=True)
        self._thread.start()

    def items(self) -> Iterator[Item]:
        """Yield the items."""
        while True:
            item = self._next()
            if item is None:
                return
            if isinstance(item, BaseException):
                raise item
            yield item

    def close(self) -> None:
        """End the thread; the iterator is closed when this returns."""
        self._stopped.set()
        self._thread.join()

    def _next(self) -> Item | BaseException | None:
        # With a limit, so that a signal is not kept waiting.
        while True:
            try:
                return self._queue.get(timeout=_WAIT_SECONDS)
            except Empty:
                continue

    def _run(self) -> None:
        end: BaseException | None = None
        try:
            iterator = self._make()
            try:
                for item in iterator:
                    if not self._put(item):
                        break
            finally:
                close = getattr(iterator, "close", None)
                if close is not None:
                    close()
        except BaseException as error:
            end = error
        self._put(end)

    def _put(self, item: Item | BaseException | None) -> bool:
        while not self._stopped.is_set():
            try:
                self._queue.put(item, timeout=_WAIT_SECONDS)
            except Full:
                continue
            return True
        return False
