"""Scheduler of the simulation: what happens next, in the order of time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from heapq import heappop, heappush
from itertools import count
from math import log
from random import Random
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from msgflow_sim.truth import Truth

Action = Callable[[int, Any], None]
# Returns the next even number in 0..1.
Dice = Callable[[], float]

_GRACE_NS = 1_000_000_000


def tail(random: Dice, scale: int) -> int:
    """A waiting time with mean `scale`: mostly short, now and then long."""
    return int(-log(1.0 - random()) * scale)


class Scheduler:
    """The agenda, all dice and the truth.

    Time is in ns since the begin of tracing, the same on all hosts.

    Attributes:
        truth: where what happens is written down.
        publication_ids: numbers for publications; likewise for takes, callback instances,
            requests and subscriptions.
        end: time of the last event of any thread so far.
    """

    def __init__(self, seed: str, truth: Truth) -> None:
        self._seed = seed
        self._named: Counter[str] = Counter()
        self.truth = truth
        self.publication_ids = count()
        self.take_ids = count()
        self.callback_instance_ids = count()
        self.request_ids = count()
        self.user_event_ids = count()
        self.subscription_ids = count()
        self.end = 0
        self._agenda: list[tuple[int, int, Action, Any]] = []
        self._order = count()

    def at(self, time: int, action: Action, argument: Any = None) -> None:
        """Have `action(time, argument)` called at `time`."""
        heappush(self._agenda, (time, next(self._order), action, argument))

    def dice(self, *names: object) -> Dice:
        """Random numbers for one object alone, by its name; a second one of it has others.

        The seed and the name decide them. So systems that differ in one thing draw the same
        numbers wherever they do the same.
        """
        name = "/".join(str(name) for name in names)
        self._named[name] += 1
        return Random(f"{self._seed}/{name}/{self._named[name]}").random

    def run(self, stop: int, last: Action) -> None:
        """Let things happen until `stop` and on until the next `last` action would.

        A second later it ends even without one.
        """
        agenda = self._agenda
        while agenda:
            time = agenda[0][0]
            if time >= stop and (agenda[0][2] == last or time > stop + _GRACE_NS):
                return
            _, _, action, argument = heappop(agenda)
            action(time, argument)

    def left(self, action: Action) -> Iterator[Any]:
        """Arguments of the calls of `action` that did not happen, in the order of time."""
        return (
            entry[3] for entry in sorted(self._agenda, key=lambda e: e[:2]) if entry[2] == action
        )
