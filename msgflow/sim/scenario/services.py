"""Services: callbacks that answer and publish, clients that wait or do not, a managed node."""

from __future__ import annotations

from msgflow.sim.entity import (
    MILLISECOND,
    SECOND,
    Call,
    Client,
    Publisher,
    Service,
    Subscription,
    Timer,
    Transition,
    Work,
)
from msgflow.sim.system import Executor, Group, Host, Node, Process, Scenario


def services() -> Scenario:
    """Requests between two hosts, and transitions of a managed node."""
    planner = Node(
        "planner",
        groups=(Group("answers", executor=1),),
        publishers=(Publisher("/goal"), Publisher("/answered")),
        clients=(
            Client("/plan", ("/answered",)),
            Client("/map/get", group="answers"),
            Client("/driver/change_state"),
        ),
        subscriptions=(Subscription("/plan_made", does=(Call("/map/get", spins=1),)),),
        timers=(
            Timer(20 * MILLISECOND, ("/goal",), does=(Call("/plan"),)),
            Timer(400 * MILLISECOND, does=(Call("/driver/change_state"),)),
        ),
    )
    server = Node(
        "server",
        publishers=(Publisher("/plan_made"),),
        services=(
            Service("/plan", ("/plan_made",), Work(2 * MILLISECOND, MILLISECOND), logs=True),
            Service("/map/get"),
        ),
    )
    driver = Node(
        "driver",
        is_managed=True,
        services=(Service("/driver/change_state", does=(Transition(),)),),
        subscriptions=(Subscription("/goal"), Subscription("/answered")),
    )
    return Scenario(
        name="services",
        description="Clients and services on two hosts that publish, and a managed node.",
        hosts=(Host("alpha"), Host("beta", clock_offset_ns=80 * MILLISECOND)),
        processes=(
            Process("server", "beta", 1101, (server,)),
            Process("driver", "alpha", 1201, (driver,), start_ns=3 * MILLISECOND),
            Process(
                "planner", "alpha", 1301, (planner,), start_ns=60 * MILLISECOND,
                executors=(Executor(), Executor("nested")),
            ),
        ),
        duration_ns=3 * SECOND,
        layout="rolling",
    )  # fmt: skip
