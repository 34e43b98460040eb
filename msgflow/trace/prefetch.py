"""Prefetch: a thread makes the items of an iterator ahead of their use."""

from __future__ import annotations

from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from concurrent.futures import Future

Item = TypeVar("Item")

_END = object()


class Prefetch(Generic[Item]):
    """Items of an iterator, made while the consumer works on those before.

    An error of the iterator is raised where the item would have been.
    """

    def __init__(self, make: Callable[[], Iterator[Item]], most: int) -> None:
        """Start; at most so many items wait, and one more is being made."""
        self._thread = ThreadPoolExecutor(1, "msgflow-reader")
        self._iterator = make()
        self._waiting = deque(self._following() for _ in range(most + 1))

    def items(self) -> Iterator[Item]:
        """Yield the items."""
        while (item := self._waiting.popleft().result()) is not _END:
            self._waiting.append(self._following())
            yield item

    def close(self) -> None:
        """End the thread; the iterator is closed when this returns."""
        self._thread.shutdown(cancel_futures=True)
        if hasattr(self._iterator, "close"):
            self._iterator.close()

    def _following(self) -> Future[Any]:
        return self._thread.submit(next, self._iterator, _END)
