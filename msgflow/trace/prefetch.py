"""Prefetch: a thread makes the items of an iterator ahead of their use."""

from __future__ import annotations

from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Generator

Item = TypeVar("Item")


def prefetched(items: Generator[Item, None, None], most: int) -> Generator[Item, None, None]:
    """Yield items that are made while the consumer works on those before; at most so many wait.

    An error is raised where its item would have been. Once this generator is closed, or ends,
    `items` is closed and the thread has ended.
    """
    with ThreadPoolExecutor(1, thread_name_prefix="msgflow-reader") as thread:
        futures = deque(thread.submit(next, items, None) for _ in range(most + 1))
        try:
            while (item := futures.popleft().result()) is not None:
                futures.append(thread.submit(next, items, None))
                yield item
        finally:
            thread.shutdown(cancel_futures=True)
            items.close()
