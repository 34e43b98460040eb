"""Actions: goals that are accepted, rejected, cancelled, side by side, and asked for late."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, ActionClient, ActionServer, SendGoal, Timer
from msgflow_sim.system import Executor, Host, Node, Process, Scenario


def actions() -> Scenario:
    """Two action servers on another host. One executes goals side by side."""
    acting = Node(
        "acting",
        action_servers=(
            ActionServer("/dock", rejects=5),
            ActionServer("/move", period_ns=20 * MILLISECOND, threads=2, rejects=7),
        ),
    )
    asking = Node(
        "asking",
        action_clients=(
            ActionClient("/dock", cancels=4),
            ActionClient("/move"),
        ),
        timers=(
            Timer(40 * MILLISECOND, does=(SendGoal("/dock"),)),
            Timer(90 * MILLISECOND, does=(SendGoal("/move"),)),
        ),
    )
    late = Node(
        "late",
        action_clients=(ActionClient("/move", asks_at_once=False),),
        timers=(Timer(170 * MILLISECOND, does=(SendGoal("/move"),)),),
    )
    return Scenario(
        name="actions",
        description="Goals of two actions: accepted, rejected, cancelled, side by side.",
        hosts=(Host("alpha"), Host("beta", clock_offset_ns=80 * MILLISECOND)),
        processes=(
            Process("acting", "beta", 1101, (acting,), executors=(Executor("multi_threaded", 2),)),
            Process("asking", "alpha", 1301, (asking,), start_ns=60 * MILLISECOND),
            Process("late", "alpha", 1401, (late,), start_ns=80 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
        layout="rolling",
    )
