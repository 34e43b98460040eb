"""Prefetch: a thread makes the items of an iterator ahead of their use."""

from __future__ import annotations

import sys
from collections.abc import Generator
from queue import SimpleQueue
from threading import Semaphore, Thread
from typing import TypeVar

Item = TypeVar("Item")


def prefetched(items: Generator[Item, None, None], most: int) -> Generator[Item, None, None]:
    """Yield items that are made while the consumer works on those before; at most so many wait.

    An error is raised where its item would have been. Once this generator is closed, or ends,
    `items` is closed and the thread has ended.
    """
    made = SimpleQueue[Item | BaseException | None]()
    places = Semaphore(most + 1)
    is_wanted = True

    def make() -> None:
        item: Item | BaseException | None = None
        while places.acquire() and is_wanted:
            try:
                item = next(items, None)
            except BaseException as error:
                item = error
            made.put(item)
            if item is None or isinstance(item, BaseException):
                return

    # No pool of threads: it takes no work once the main thread has ended, though others go on.
    thread = Thread(target=make, name="msgflow-reader", daemon=True)
    thread.start()
    try:
        while (item := made.get()) is not None:
            if isinstance(item, BaseException):
                raise item
            places.release()
            yield item
    finally:
        is_wanted = False
        places.release()
        # When the interpreter ends, the thread stands still, perhaps within `items`.
        if not sys.is_finalizing():
            thread.join()
            items.close()
