"""User threads: they create and destroy subscriptions while executors spin."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from msgflow_sim.machine import RunningProcess, Steps, Thread

if TYPE_CHECKING:
    from msgflow_sim.creation import Creator, NodeContext
    from msgflow_sim.entity import Subscription
    from msgflow_sim.objects import SubscriptionObject

_NUMBER = 8


class UserThread(Thread):
    """A thread of a process that does at given times what was planned."""

    def __init__(self, process: RunningProcess, creator: Creator) -> None:
        super().__init__(process, process.description.tid(_NUMBER))
        self._creator = creator.on(self)
        self._plans: list[tuple[int, Callable[[], Callable[[], None]]]] = []

    def plan(
        self,
        node: NodeContext,
        description: Subscription,
        symbol: str,
        existing: SubscriptionObject | None,
    ) -> None:
        """Create a subscription, unless it exists, and destroy it, when it is time."""
        found = [existing]

        def create() -> Callable[[], None]:
            created = found[0] = self._creator.subscription(node, description, symbol)
            return lambda: self._creator.listen(created)

        def destroy() -> Callable[[], None]:
            subscription = found[0]
            assert subscription is not None
            return lambda: self._creator.end_subscription(subscription)

        if description.created_ns is not None:
            self._plans.append((description.created_ns, create))
        if description.destroyed_ns is not None:
            self._plans.append((description.destroyed_ns, destroy))

    def begin_if_needed(self, time: int) -> None:
        """Begin, if anything was planned."""
        if self._plans:
            self.begin(time, self._follow(time))

    def _follow(self, time: int) -> Steps:
        for due, begin in sorted(self._plans, key=lambda plan: plan[0]):
            time = yield max(due, time)
            while later := self.take_cpu(time):
                time = yield later
            self._creator.time = time
            complete = begin()
            # Others are to know of it when it is there, not earlier.
            self._creator.time = yield self.hold(self._creator.time)
            complete()
            time = self._creator.time + 1_000
            self.keep_cpu(time)
        return time
