"""Services: callbacks that answer and publish, clients that wait or do not, a managed node."""

from __future__ import annotations

from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    Answer,
    Call,
    Client,
    Publisher,
    Service,
    Subscription,
    Timer,
    Transition,
    Work,
)
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario


def calls() -> Scenario:
    """What clients do with responses, and an action server, whose callbacks are not traced."""
    asking = Node(
        "asking",
        publishers=(Publisher("/tick"), Publisher("/asked"), Publisher("/result")),
        clients=(
            Client("/accept", ("/asked",), does=(Call("/finish"),)),
            Client("/finish", ("/result",)),
            Client("/sum", ("/result",)),
            Client("/total", ("/result",)),
        ),
        subscriptions=(Subscription("/sensor", does=(Call("/accept"),)),),
        timers=(Timer(30 * MILLISECOND, ("/tick",), does=(Call("/sum"), Call("/total"))),),
    )
    acting = Node(
        "acting",
        publishers=(Publisher("/status"), Publisher("/summed")),
        clients=(Client("/inner"),),
        services=(
            Service("/accept", ("/status",), is_action=True),
            Service("/finish", ("/status",), does=(Call("/inner"),), is_action=True),
            Service("/sum", ("/summed",)),
            Service("/inner"),
        ),
    )
    # It answers when another service has answered it, and hears what that answers to others.
    asked = Node(
        "asked",
        clients=(Client("/inner", does=(Answer("/total"),)),),
        services=(
            Service("/total", does=(Call("/inner"),), is_deferred=True, is_answered_later=True),
        ),
    )
    source = Node(
        "source",
        publishers=(Publisher("/sensor"),),
        timers=(Timer(20 * MILLISECOND, ("/sensor",)),),
    )
    sink = Node(
        "sink",
        subscriptions=tuple(
            Subscription(topic) for topic in ("/tick", "/asked", "/result", "/status", "/summed")
        ),
    )
    return Scenario(
        name="calls",
        description="Clients that publish and call with a response, and an action server.",
        hosts=(Host("alpha"),),
        processes=(
            Process("acting", "alpha", 1101, (acting,), executors=(Executor("multi_threaded", 2),)),
            Process("sink", "alpha", 1201, (sink,), start_ns=3 * MILLISECOND),
            Process("asked", "alpha", 1501, (asked,), start_ns=40 * MILLISECOND),
            Process("asking", "alpha", 1301, (asking,), start_ns=60 * MILLISECOND),
            Process("source", "alpha", 1401, (source,), start_ns=80 * MILLISECOND),
        ),
        duration_ns=2 * SECOND,
        layout="rolling",
    )


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
            Service("/map/get", is_deferred=True),
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
                "planner",
                "alpha",
                1301,
                (planner,),
                start_ns=60 * MILLISECOND,
                executors=(Executor(), Executor("nested")),
            ),
        ),
        duration_ns=3 * SECOND,
        layout="rolling",
    )
