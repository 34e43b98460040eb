"""Small systems for the simulator: one host, and as a rule a process for each node."""

from __future__ import annotations

from typing import Any

from msgflow_sim import Host, Node, Process, Publisher, Scenario, Subscription, Timer, Work
from msgflow_sim.entity import MILLISECOND


def alone(node: Node, pid: int, **given: Any) -> Process:
    """Return a process with one node, which has its name; `given` are other attributes."""
    return Process(node.name, "robot", pid, (node,), **given)


def robot(*parts: Node | Process, **given: Any) -> Scenario:
    """Return a system of processes, and of nodes each in one of its own.

    Args:
        parts: processes of the host robot, and nodes.
        given: other attributes of the scenario.
    """
    processes = tuple(
        part if isinstance(part, Process) else alone(part, 1001 + 100 * number)
        for number, part in enumerate(parts)
    )
    usual = {"name": "robot", "description": "A small system.", "hosts": (Host("robot"),)}
    return Scenario(**usual | {"processes": processes} | given)


# What a fast node, which may share its executor with a slow one, makes of messages, and who hears.
FAST = Node(
    "fast",
    publishers=(Publisher("/answer"),),
    subscriptions=(Subscription("/often", ("/answer",), Work(MILLISECOND, MILLISECOND)),),
)
SINK = Node("sink", subscriptions=(Subscription("/answer"),))


def sources(often_ms: int, seldom_ms: int) -> Node:
    """Return a node with timers of these periods, which publish on /often and /seldom."""
    periods = {"/often": often_ms, "/seldom": seldom_ms}
    return Node(
        "sources",
        publishers=tuple(map(Publisher, periods)),
        timers=tuple(
            Timer(period * MILLISECOND, (topic,), Work(100_000, 100_000))
            for topic, period in periods.items()
        ),
    )
