"""Runs steps of which some need others, several at the same time."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence


def run(needs: Sequence[Collection[int]], workers: Sequence[Callable[[int], None]]) -> None:
    """Run each step once, after those that it needs, until all have run or one has failed.

    Of the steps that can be run the one comes first after which most others wait in a row.

    Args:
        needs: for each step the steps that it needs, all of which come before it.
        workers: each runs one step at a time, all of them in threads of their own.

    Raises:
        ValueError: a step needs itself or a later one.
        BaseException: what the first failing step raised, once no other step is under way.
    """
    _Work(needs).be_done_by(workers)


class _Work:
    def __init__(self, needs: Sequence[Collection[int]]) -> None:
        self._needs = [frozenset(each) for each in needs]
        for step, its in enumerate(self._needs):
            if its and max(its) >= step:
                raise ValueError(f"step {step} needs itself or a later one: {sorted(its)}")
        self._waiting = set(range(len(needs)))
        self._done: set[int] = set()
        self._failure: BaseException | None = None
        self._changed = threading.Condition()
        self._followers = [0] * len(needs)  # in the longest row of steps after each
        for step in reversed(range(len(needs))):
            for needed in needs[step]:
                more = 1 + self._followers[step]
                self._followers[needed] = max(self._followers[needed], more)

    def be_done_by(self, workers: Sequence[Callable[[int], None]]) -> None:
        with ThreadPoolExecutor(len(workers), "side by side") as executor:
            for each in [executor.submit(self._keep_working, worker) for worker in workers]:
                each.result()
        if self._failure is not None:
            raise self._failure

    def _keep_working(self, worker: Callable[[int], None]) -> None:
        while (step := self._next()) is not None:
            try:
                worker(step)
            except BaseException as error:
                self._end(step, error)
            else:
                self._end(step, None)

    def _next(self) -> int | None:
        """Return a step that can be run, as soon as there is one; None where none is left."""
        with self._changed:
            while self._waiting and self._failure is None:
                ready = [step for step in self._waiting if self._needs[step] <= self._done]
                if ready:
                    step = max(ready, key=lambda each: (self._followers[each], -each))
                    self._waiting.remove(step)
                    return step
                self._changed.wait()
            return None

    def _end(self, step: int, error: BaseException | None) -> None:
        with self._changed:
            if error is None:
                self._done.add(step)
            elif self._failure is None:
                self._failure = error
            self._changed.notify_all()
