"""Small systems for the simulator: one host, and as a rule a process for each node."""

from __future__ import annotations

from typing import Any

from msgflow_sim import Host, Node, Process, Scenario


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
