"""Systems of the simulator of ten to forty nodes, in which one thing changes at some moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from random import Random

from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    ActionClient,
    ActionServer,
    Call,
    Client,
    Publisher,
    SendGoal,
    Service,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim.recording import Recording
from msgflow_sim.system import Host, KernelTrace, Load, Node, Process, Scenario

SIZED = ("slower", "faster", "for_a_while", "growing", "slower_timer")
"""Kinds of changes that are larger or smaller."""
KINDS = (
    *SIZED,
    "stopped",
    "ended",
    "restarted",
    "joined",
    "lossy",
    "hog",
    "burst",
    "overloaded",
    "parameter",
    "goal",
    "service",
)
SIZES = (1.1, 1.2, 1.5, 2, 3, 5, 10)
LOSSES = (0.1, 0.3, 0.3, 1)
_STEPS = 200
_HOG = "hog"
_ACTION, _SERVICE, _PARAMETERS = "/work", "/reset", "/parameter_events"


@dataclass(frozen=True)
class Planted:
    """What changes.

    Attributes:
        kind: one of `KINDS`; empty: nothing changes.
        size: how many times as long or as much; the share of messages that is lost.
        moments: when, since the begin of tracing [s]; none of what grows all the time.
        node: full name of the node that is to blame; empty: a program without ROS.
        occasion: what the sentence on what began has to name; empty: nothing began.
        faults: what the recording suffers from.
    """

    kind: str
    size: float
    moments: tuple[float, ...]
    node: str
    occasion: str
    faults: str


@dataclass
class _Member:
    """A node to be: it has a timer, or answers its first input; its period and work in ms."""

    name: str
    inputs: Sequence[str]
    output: str
    has_timer: bool
    period: float
    work: float


def changing(kind: str, seed: int) -> tuple[Scenario, Planted]:
    """Return a system of its own for each kind and seed, and what changes in it."""
    random = Random(f"{kind} {seed}")
    seconds = random.choice([20, 20, 25, 40])
    at = int(random.uniform(0.2, 0.75) * seconds * SECOND)
    until = at + int(0.2 * seconds * SECOND)
    size = random.choice(LOSSES if kind == "lossy" else SIZES)
    back = at + int(random.uniform(0.5, 3) * SECOND)
    host_count = 1 if kind == "hog" else random.choice([1, 1, 2])
    members = _members(random)
    while not any(_may_change(each, kind) for each in members):
        members = _members(random)
    target = random.choice([each for each in members if _may_change(each, kind)])
    if kind in SIZED and target.inputs:
        # Its thread keeps up with its input.
        target.work = min(target.work, 0.6 * target.period / size)
    if kind == "hog":
        # All of it fits into two CPUs before, and into what is left behind, or not.
        load = sum(each.work / each.period for each in members)
        share = min(1, random.uniform(0.5, 1.4) / load)
        for each in members:
            each.work *= share
    if kind in {"parameter", "goal"}:
        target.work = min(target.work, 0.15 * target.period)
    paces = _paces(kind, size, at, until, seconds, 1.4 * target.period / target.work)
    ends = kind in {"ended", "restarted"}
    processes = [
        Process(
            f"process_{number}",
            f"host{number % host_count}",
            1000 + 20 * number,
            tuple(_node(each, random, target, kind, size, at, paces) for each in group),
            start_ns=15 * number * MILLISECOND,
            stop_ns=at if ends and target in group else None,
            is_killed=ends and target in group,
        )
        for number, group in enumerate(_groups(members, target, random))
    ]
    if kind == "restarted":
        processes.append(replace(processes[0], pid=9000, start_ns=back, stop_ns=None))
    if kind == "joined":
        listener = Subscription(target.output, work=Work(MILLISECOND, MILLISECOND))
        processes.append(
            Process("late", "host0", 9000, (Node("late", subscriptions=(listener,)),), at)
        )
    if kind in {"goal", "service"}:
        once = ((at + MILLISECOND, 0),)
        does = SendGoal(_ACTION) if kind == "goal" else Call(_SERVICE)
        caller = Node(
            "caller",
            timers=(Timer(at, work=Work(), does=(does,), periods=once),),
            clients=(Client(_SERVICE),) if kind == "service" else (),
            action_clients=(ActionClient(_ACTION),) if kind == "goal" else (),
        )
        processes.append(Process("caller", "host0", 9000, (caller,)))
    loads = (Load(_HOG, 9500, 30 * MILLISECOND, 27 * MILLISECOND, 79, (0,), at),)
    faults, recording = _faults(random, seconds)
    scenario = Scenario(
        name=f"{kind or 'stationary'}_{seed}",
        description="A system in which something changes.",
        hosts=tuple(
            Host(
                f"host{number}",
                cpu_count=2 if kind == "hog" else 8,
                clock_offset_ns=3 * number * MILLISECOND,
                clock_drift_ppm=5.0 * number,
                kernel=KernelTrace(loads) if kind == "hog" else None,
            )
            for number in range(host_count)
        ),
        processes=tuple(processes),
        duration_ns=seconds * SECOND,
        layout="kilted" if kind == "service" else random.choice(["humble", "jazzy", "kilted"]),
        overwrites=True,
        recording=recording,
    )
    moments = {
        "growing": (),
        "for_a_while": (at / SECOND, until / SECOND),
        "restarted": (at / SECOND, back / SECOND),
        "": (),
    }
    node = "/" + target.name
    return scenario, Planted(
        kind,
        size,
        moments.get(kind, (at / SECOND,)),
        "" if kind == "hog" else node,
        {
            "ended": node,
            "restarted": node,
            "joined": "/late",
            "hog": _HOG,
            "parameter": f"a parameter of {node} was set",
            "goal": f"a goal of {_ACTION}",
            "service": f"{_SERVICE} was called",
        }.get(kind, ""),
        faults,
    )


def _members(random: Random) -> list[_Member]:
    count = random.randint(10, 40)
    members: list[_Member] = []
    for number in range(count):
        name, output = f"node_{number}", f"/topic_{number}"
        if number < max(2, count // 4):
            period: float = random.choice([10, 20, 33, 50, 100, 200])
            work = min(0.1 * period, random.uniform(0.1, 3))
            members.append(_Member(name, (), output, True, period, work))
            continue
        sources = random.sample(
            [each for each in members if each.output], random.choice([1, 1, 1, 2])
        )
        has_timer = random.random() < 0.15
        period = random.choice([20, 50, 100, 200]) if has_timer else sources[0].period
        work = min(0.12 * period, random.choice([0.2, 1, 2, 5, 10, 20]) * random.uniform(0.5, 1.5))
        is_sink = random.random() < 0.15
        members.append(
            _Member(
                name,
                [each.output for each in sources],
                "" if is_sink else output,
                has_timer,
                period,
                work,
            )
        )
    return members


def _may_change(member: _Member, kind: str) -> bool:
    if kind in {"slower_timer", "stopped", "burst", "service"}:
        return not member.inputs
    if kind == "joined":
        return bool(member.output) and not member.inputs
    if kind == "restarted":
        return bool(member.output)
    if kind == "overloaded":
        return bool(member.inputs) and not member.has_timer and member.period <= 100
    if kind in {"slower", "faster", "for_a_while", "growing", "lossy", "parameter", "goal"}:
        # What computes less than a millisecond more is not looked at.
        return bool(member.inputs) and not member.has_timer and member.work >= 2
    return True


def _paces(
    kind: str, size: float, at: int, until: int, seconds: int, overload: float
) -> tuple[tuple[int, float], ...]:
    if kind == "growing":
        return tuple(
            (step * seconds * SECOND // _STEPS, 1 + (size - 1) * step / _STEPS)
            for step in range(_STEPS)
        )
    return {
        "slower": ((at, size),),
        "faster": ((0, size), (at, 1.0)),
        "for_a_while": ((at, size), (until, 1.0)),
        "joined": ((at, 5.0),),
        "parameter": ((at, 4.0),),
        "goal": ((at, 4.0),),
        "overloaded": ((at, max(2.0, overload)),),
    }.get(kind, ())


def _groups(members: Sequence[_Member], target: _Member, random: Random) -> list[list[_Member]]:
    """Return the nodes of each process: one or two; what changes is alone."""
    groups: list[list[_Member]] = [[target]]
    for member in members:
        if member is target:
            continue
        if len(groups) > 1 and len(groups[-1]) < 2 and random.random() < 0.3:
            groups[-1].append(member)
        else:
            groups.append([member])
    return groups


def _node(
    member: _Member,
    random: Random,
    target: _Member,
    kind: str,
    size: float,
    at: int,
    paces: tuple[tuple[int, float], ...],
) -> Node:
    is_target = member is target
    typical = int(member.work * MILLISECOND)
    is_at_times_slow = random.random() < 0.1
    work = Work(
        typical,
        int(typical * random.choice([0.1, 0.3, 1.0])),
        0.03 if is_at_times_slow else 0,
        2 * typical if is_at_times_slow else 0,
        paces=paces if is_target else (),
    )
    always_lost = 0.0 if is_target else random.choice([0.1, *[0.0] * 20])
    outputs = (member.output,) if member.output else ()
    subscriptions = tuple(
        Subscription(
            topic,
            () if member.has_timer or number else outputs,
            Work() if member.has_timer or number else work,
            loss=size if kind == "lossy" and is_target else always_lost,
            loss_from_ns=at if is_target else 0,
        )
        for number, topic in enumerate(member.inputs)
    )
    period = int(member.period * MILLISECOND)
    periods = {
        "stopped": ((at, 0),),
        "slower_timer": ((at, int(size * period)),),
        "burst": ((at, period // 10), (at + 2 * period, period)),
    }
    timers = [Timer(period, outputs, work, periods=periods.get(kind, ()) if is_target else ())]
    if not member.has_timer:
        timers.clear()
    topics = outputs
    if is_target and kind == "parameter":
        once = ((at + MILLISECOND, 0),)
        timers.append(Timer(at, (_PARAMETERS,), Work(), periods=once))
        topics = (*outputs, _PARAMETERS)
    # A request that is handled keeps the timers of its node from being called.
    handling = Work(6 * period + 300 * MILLISECOND)
    return Node(
        member.name,
        publishers=tuple(Publisher(topic) for topic in topics),
        subscriptions=subscriptions,
        timers=tuple(timers),
        services=(Service(_SERVICE, work=handling),) if is_target and kind == "service" else (),
        action_servers=(ActionServer(_ACTION),) if is_target and kind == "goal" else (),
    )


def _faults(random: Random, seconds: int) -> tuple[str, Recording]:
    name = random.choice(["none", "none", "none", "lost events", "clock set"])
    if name == "lost events":
        return name, Recording(lost_event_share=0.02)
    if name == "clock set":
        moment = int(random.uniform(0.2, 0.8) * seconds * SECOND)
        return name, Recording(realtime_steps=((moment, 500 * MILLISECOND),))
    return name, Recording()
