"""Annotated links of a node: what its caches hold, and what a publication is made of."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from msgflow_sim.approximate_time import ApproximateTime
from msgflow_sim.callback_instance import CallbackInstance, Cause

if TYPE_CHECKING:
    from msgflow_sim.entity import MessageLink
    from msgflow_sim.system import Node

# More callbacks than this cannot end while another one is being run.
_KEPT = 64
# Kinds of links that wait for a message of every input.
SYNCHRONOUS = ("partial_sync", "approximate_sync")


@dataclass(slots=True, eq=False)
class LinkObject:
    """A link of a node that runs.

    Attributes:
        description: what the scenario says about it.
        filled_by: full name of the node whose callbacks fill its caches.
        used_by: full name of the node that publishes what is made of them.
        ended: for each input the runs of its callback that have ended, each with its end.
        waiting: for each input the run whose message is there to be used (partial_sync).
        used: runs whose messages have been used.
        filter: what makes the sets (approximate_sync).
    """

    description: MessageLink
    filled_by: str
    used_by: str
    ended: dict[str, deque[tuple[int, CallbackInstance]]] = field(default_factory=dict)
    waiting: dict[str, CallbackInstance] = field(default_factory=dict)
    used: set[int | None] = field(default_factory=set)
    filter: ApproximateTime[CallbackInstance] = field(init=False)

    def __post_init__(self) -> None:
        self.filter = ApproximateTime(len(self.description.inputs))

    def keep(self, topic: str, end: int, instance: CallbackInstance) -> None:
        """The callback of an input has ended: its message is in the cache."""
        self.ended.setdefault(topic, deque(maxlen=_KEPT)).append((end, instance))

    def fire(self, topic: str, instance: CallbackInstance) -> list[tuple[CallbackInstance, ...]]:
        """A message of this input is there: returns the sets that are complete now.

        Without the message itself, but for approximate_sync, where it need not be in the set.
        """
        if self.description.kind == "approximate_sync":
            header_ns = instance.header_ns
            assert header_ns is not None
            return self.filter.add(self.description.inputs.index(topic), header_ns, instance)
        others = [other for other in self.description.inputs if other != topic]
        if not all(other in self.waiting for other in others):
            self.waiting[topic] = instance
            return []
        completed = tuple(self.waiting[other] for other in others)
        self.waiting.clear()
        return [completed]

    def latest(self, own: str | None, cut: int) -> Iterable[CallbackInstance]:
        """For each input but `own` the run that was the last to end up to the cut."""
        for topic in self.description.inputs:
            if topic == own:
                continue
            before = [entry for entry in self.ended.get(topic, ()) if entry[0] <= cut]
            if before:
                yield max(before, key=lambda entry: entry[0])[1]


def link_objects(nodes: Iterable[Node]) -> tuple[LinkObject, ...]:
    """Return the links of the nodes of a process, with empty caches."""
    return tuple(
        LinkObject(link, link.inputs_of or node.full_name, node.full_name)
        for node in nodes
        for link in node.links
    )


@dataclass(slots=True, eq=False)
class CallbackLinks:
    """What the links of its node mean for one callback.

    Attributes:
        topic: of its subscription, None for a timer or service.
        inputs: links that its messages are inputs of.
        outputs: links that have outputs which it publishes on.
    """

    topic: str | None
    inputs: tuple[LinkObject, ...]
    outputs: tuple[LinkObject, ...]

    def gates(self, *, is_late: bool) -> tuple[LinkObject, ...]:
        """Links that fire when there is a message of each input: at its begin, or late."""
        return tuple(
            link
            for link in self.inputs
            if link.description.kind in SYNCHRONOUS and link.description.is_late is is_late
        )

    def fill(
        self, instance: CallbackInstance, *, is_late: bool
    ) -> dict[LinkObject, list[tuple[CallbackInstance, ...]]]:
        """Put the message into the caches; returns the links that fire, with the sets they use."""
        fired = {}
        for link in self.gates(is_late=is_late):
            assert self.topic is not None
            completed = link.fire(self.topic, instance)
            if completed:
                fired[link] = completed
        return fired

    def may_publish(self, topic: str, fired: Iterable[LinkObject]) -> bool:
        """Whether it publishes on a topic, when these links have fired."""
        gates = [
            link
            for link in self.inputs
            if link.description.kind in SYNCHRONOUS and topic in link.description.outputs
        ]
        return not gates or any(link in fired for link in gates)

    def set_count(
        self, topic: str, fired: dict[LinkObject, list[tuple[CallbackInstance, ...]]]
    ) -> int:
        """How often it publishes on a topic: once for each set of the links that have fired."""
        counts = [len(sets) for link, sets in fired.items() if topic in link.description.outputs]
        return max(counts, default=1)

    def is_gated(self, topics: Sequence[str]) -> bool:
        """Whether everything that it publishes waits for other inputs."""
        return bool(topics) and not any(self.may_publish(topic, ()) for topic in topics)

    def cause(
        self,
        topic: str,
        instance: CallbackInstance,
        fired: dict[LinkObject, list[tuple[CallbackInstance, ...]]],
        time: int,
        number: int = 0,
    ) -> CallbackInstance:
        """The run of the callback, with all that its publication on a topic is made of.

        `number`: how often it has published on the topic before, once for each set.
        """
        causes = []
        for link in self.outputs:
            description = link.description
            if topic not in description.outputs:
                continue
            if description.kind in SYNCHRONOUS:
                sets = fired.get(link, [])
                used: Iterable[CallbackInstance] = sets[number] if number < len(sets) else ()
            else:
                used = link.latest(self.topic, time if description.is_late else instance.start)
            for each in used:
                key = each.callback_instance_id
                causes.append(Cause(description.kind, each, key in link.used))
                link.used.add(key)
        return replace(instance, causes=tuple(causes))

    def end(self, end: int, instance: CallbackInstance) -> None:
        """It has ended."""
        for link in self.inputs:
            assert self.topic is not None
            link.keep(self.topic, end, instance)
