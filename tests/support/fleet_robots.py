"""Short recordings of a simulated fleet: robots differ, starts differ, and so may versions."""

from __future__ import annotations

import math
import random
import shutil
from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow_sim import scenarios, simulate
from msgflow_sim.entity import MICROSECOND, Work

if TYPE_CHECKING:
    from pathlib import Path

    from msgflow_sim.system import Scenario

# How much the same robot differs from start to start, and robots from each other: shares.
OF_STARTS = 0.03
OF_ROBOTS = 0.02
_ROBOTS = 20


def robot_of(number: int) -> str:
    """Return which robot made a recording."""
    return f"r{number % _ROBOTS}"


def record(directory: Path, number: int, *, slower: float = 0.0, factor: float = 0.02) -> None:
    """Write a recording of the pipeline, whose relay works for some half a millisecond.

    Args:
        directory: where to write; the truth is left out.
        number: which recording; it tells the robot, and all that is random.
        slower: how much longer every callback takes, as a share.
        factor: multiplies the 10 s of the pipeline.
    """
    own, start = random.Random(robot_of(number)), random.Random(number)
    pace = (1 + slower) * math.exp(own.gauss(0, OF_ROBOTS) + start.gauss(0, OF_STARTS))
    simulate(_pipeline(pace), directory, factor=factor, seed=number)
    shutil.rmtree(directory / "truth")


def write_broken(directory: Path, number: int) -> None:
    """Write what cannot be ingested: nonsense for metadata, or an empty stream without any."""
    directory.mkdir(parents=True)
    if number % 20 < 10:
        (directory / "metadata").write_text("broken")
    else:
        (directory / "stream_0").write_bytes(b"")


def _pipeline(pace: float) -> Scenario:
    scenario = scenarios()["pipeline"]
    work = Work(int(500 * MICROSECOND * pace), int(60 * MICROSECOND * pace))
    processes = tuple(
        replace(
            process,
            nodes=tuple(
                replace(
                    node,
                    subscriptions=tuple(replace(s, work=work) for s in node.subscriptions),
                    timers=tuple(replace(t, work=work) for t in node.timers),
                )
                for node in process.nodes
            ),
        )
        for process in scenario.processes
    )
    return replace(scenario, processes=processes)
