"""Traffic between hosts with clocks of their own: steady, sparse, in bursts, mostly one way."""

from __future__ import annotations

from msgflow_sim.entity import MILLISECOND, SECOND, Publisher, Subscription, Timer
from msgflow_sim.recording import Recording
from msgflow_sim.system import Host, Node, Process, Scenario

# Name of a kind, and for each way the period of its timer and how many messages that sends at once.
TRAFFIC = {
    "steady": ((10 * MILLISECOND, 1), (10 * MILLISECOND, 1)),
    "sparse": ((300 * MILLISECOND, 1), (700 * MILLISECOND, 1)),
    "bursts": ((900 * MILLISECOND, 25), (600 * MILLISECOND, 12)),
    "asymmetric": ((4 * MILLISECOND, 1), (600 * MILLISECOND, 1)),
    "one_way_late": ((10 * MILLISECOND, 1), (10 * MILLISECOND, 1)),
    "late_and_paused": ((10 * MILLISECOND, 1), (20 * MILLISECOND, 1)),
}
# One way nothing is sent after this.
_SILENT_FROM = 300 * MILLISECOND


def traffic(kind: str, duration_ns: int = 3 * SECOND) -> Scenario:
    """Return two hosts that exchange messages in one of the kinds of `TRAFFIC`.

    Args:
        kind: 'one_way_late': one way only after a third of a second; 'late_and_paused': recording
            starts late on one host and pauses on the other.
        duration_ns: how long it is traced.
    """
    there, back = TRAFFIC[kind]
    recordings: tuple[Recording | None, Recording | None] = (None, None)
    if kind == "late_and_paused":
        third = duration_ns // 3
        recordings = (
            Recording(start_ns=duration_ns // 5),
            Recording(pauses=((third, 3 * third // 2),)),
        )
    return Scenario(
        name=f"traffic_{kind}",
        description="Two hosts that send each other messages.",
        hosts=(
            Host("alpha", recording=recordings[0]),
            Host("beta", recording=recordings[1]),
        ),
        processes=(
            _sender("there", "alpha", 1101, *there),
            _receiver("there", "beta", 1201),
            _sender(
                "back",
                "beta",
                1301,
                *back,
                stop_ns=_SILENT_FROM if kind == "one_way_late" else None,
            ),
            _receiver("back", "alpha", 1401),
        ),
        duration_ns=duration_ns,
    )


def host_chain() -> Scenario:
    """Three hosts: the first and the last exchange messages only with the one between them."""
    hosts = ("alpha", "beta", "gamma")
    ways = (("alpha", "beta"), ("beta", "alpha"), ("beta", "gamma"), ("gamma", "beta"))
    return Scenario(
        name="host_chain",
        description="Three hosts in a chain, whose clocks drift apart.",
        hosts=tuple(
            Host(name, clock_offset_ns=number * 40 * MILLISECOND, clock_drift_ppm=drift)
            for number, (name, drift) in enumerate(zip(hosts, (0, 90, -70), strict=True))
        ),
        processes=tuple(
            process
            for number, (sender, receiver) in enumerate(ways)
            for process in (
                _sender(f"{sender}_{receiver}", sender, 1101 + 200 * number, 7 * MILLISECOND, 1),
                _receiver(f"{sender}_{receiver}", receiver, 1201 + 200 * number),
            )
        ),
        duration_ns=3 * SECOND,
    )


def _sender(
    name: str, host: str, pid: int, period_ns: int, count: int, stop_ns: int | None = None
) -> Process:
    topic = f"/{name}"
    node = Node(
        f"send_{name}",
        publishers=(Publisher(topic),),
        timers=(Timer(period_ns, (topic,) * count),),
    )
    return Process(f"send_{name}", host, pid, (node,), stop_ns=stop_ns)


def _receiver(name: str, host: str, pid: int) -> Process:
    node = Node(f"hear_{name}", subscriptions=(Subscription(f"/{name}"),))
    return Process(f"hear_{name}", host, pid, (node,))
