"""Scheduler of the simulation: what happens next, in the order of time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from heapq import heappop, heappush
from itertools import count
from math import log
from random import Random
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from msgflow_sim.truth import Truth

Action = Callable[[int, Any], None]

_GRACE_NS = 1_000_000_000


class Scheduler:
    """The agenda, the dice and the truth.

    Time is in ns since the begin of tracing, the same on all hosts.

    Attributes:
        random: next even number in 0..1. Nothing else is drawn from, so that one seed gives one
            course of events.
        truth: where what happens is written down.
        publication_ids: numbers for publications; likewise for takes, callback instances,
            requests and subscriptions.
        end: time of the last event of any thread so far.
    """

    def __init__(self, seed: str, truth: Truth) -> None:
        self.random = Random(seed).random
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

    def tail(self, scale: int) -> int:
        """A waiting time with mean `scale`: mostly short, now and then long."""
        return int(-log(1.0 - self.random()) * scale)

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
