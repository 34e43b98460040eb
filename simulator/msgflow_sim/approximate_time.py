"""Filter of messages that makes sets of those whose headers are closest in time.

It does what the policy ApproximateTime of message_filters does. Its usual settings: no limits but
that of the queues, and a penalty of a tenth for sets that end later.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

Item = TypeVar("Item")
# An end that is later by 10 has to save 11 at the start.
_END, _START = 11, 10


@dataclass(slots=True)
class _Queue(Generic[Item]):
    """Messages of an input, each with its stamp; `passed` ones are not in the sets to come."""

    waiting: deque[tuple[int, Item]] = field(default_factory=deque)
    passed: list[tuple[int, Item]] = field(default_factory=list)
    has_dropped: bool = False

    def pass_first(self) -> None:
        self.passed.append(self.waiting.popleft())

    def recall(self, count: int | None = None) -> None:
        """Let the last `count` of those that were passed wait again, all if None."""
        for _ in range(len(self.passed) if count is None else count):
            self.waiting.appendleft(self.passed.pop())


@dataclass(slots=True)
class _Candidate(Generic[Item]):
    """The best set so far: its messages, and the stamps at its ends."""

    start: int
    end: int
    items: tuple[Item, ...]


class ApproximateTime(Generic[Item]):
    """Queues of several inputs, and the search for the next set.

    `queue_size`: messages that wait of an input at the most; `longest_ns`: how far the stamps of a
    set may be apart; `apart_ns`: the stamps of an input differ by at least this.
    """

    def __init__(
        self,
        input_count: int,
        queue_size: int | None = None,
        longest_ns: int | None = None,
        apart_ns: int = 0,
    ) -> None:
        self._queues: Sequence[_Queue[Item]] = tuple(_Queue() for _ in range(input_count))
        self._candidate: _Candidate[Item] | None = None
        # Input and stamp of the message that is in all sets which are compared.
        self._pivot = (0, 0)
        self._queue_size = queue_size
        self._longest_ns = longest_ns
        self._apart_ns = apart_ns

    def add(self, number: int, stamp: int, item: Item) -> list[tuple[Item, ...]]:
        """A message of an input has come; returns the sets that are known now, first one first."""
        queue = self._queues[number]
        queue.waiting.append((stamp, item))
        # A longer queue was not what the search waited for.
        sets = self._sets() if len(queue.waiting) == 1 else []
        if self._queue_size and len(queue.waiting) + len(queue.passed) > self._queue_size:
            for each in self._queues:
                each.recall()
            queue.waiting.popleft()
            queue.has_dropped = True
            if self._candidate is not None:
                self._candidate = None
                sets += self._sets()
        return sets

    def _sets(self) -> list[tuple[Item, ...]]:
        sets: list[tuple[Item, ...]] = []
        while all(queue.waiting for queue in self._queues):
            done = self._search()
            if done is not None:
                sets.append(done)
        return sets

    def _search(self) -> tuple[Item, ...] | None:
        """Look at the set of the first messages; returns the best one if none can be better."""
        start, first, end, last = self._ends(lambda queue: queue.waiting[0][0])
        for number, queue in enumerate(self._queues):
            queue.has_dropped = queue.has_dropped and number == last
        best = self._candidate
        if best is None:
            is_long = self._longest_ns is not None and end - start > self._longest_ns
            if is_long or self._queues[last].has_dropped:
                self._queues[first].waiting.popleft()
                return None
            self._pivot = (last, end)
            best = self._choose(start, end)
        elif _END * (end - best.end) < _START * (start - best.start):
            best = self._choose(start, end)
        self._queues[first].pass_first()
        if first == self._pivot[0] or self._is_best(best, end) or self._is_best_whatever(best):
            return self._hand_over(best)
        return None

    def _ends(self, stamp: Callable[[_Queue[Item]], int]) -> tuple[int, int, int, int]:
        """The earliest stamp and its input, and the latest one."""
        stamps = [stamp(queue) for queue in self._queues]
        start, end = min(stamps), max(stamps)
        return start, stamps.index(start), end, stamps.index(end)

    def _choose(self, start: int, end: int) -> _Candidate[Item]:
        self._candidate = _Candidate(
            start, end, tuple(queue.waiting[0][1] for queue in self._queues)
        )
        for queue in self._queues:
            queue.passed.clear()
        return self._candidate

    def _is_best(self, best: _Candidate[Item], end: int) -> bool:
        """Whether sets that end so late are worse, even if they start with the pivot."""
        return _END * (end - best.end) >= _START * (self._pivot[1] - best.start)

    def _is_best_whatever(self, best: _Candidate[Item]) -> bool:
        """Whether no set can be better, if the messages to come are as early as they may be."""
        if all(queue.waiting for queue in self._queues):
            return False
        pivot = self._pivot[1]
        passed = [0] * len(self._queues)
        while True:
            start, first, end, _ = self._ends(
                lambda queue: (
                    queue.waiting[0][0]
                    if queue.waiting
                    else max(queue.passed[-1][0] + self._apart_ns, pivot)
                )
            )
            is_best = self._is_best(best, end)
            if is_best or _END * (end - best.end) < _START * (start - best.start):
                for queue, count in zip(self._queues, passed, strict=True):
                    queue.recall(count)
                return is_best
            self._queues[first].pass_first()
            passed[first] += 1

    def _hand_over(self, best: _Candidate[Item]) -> tuple[Item, ...]:
        self._candidate = None
        for queue in self._queues:
            queue.recall()
            queue.waiting.popleft()
        return best.items
