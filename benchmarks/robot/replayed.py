"""Systems of the simulator of four to forty nodes, and changes of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from random import Random

from msgflow.replay.change import Change
from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    MessageLink,
    Publisher,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim.system import Executor, Host, Node, Process, Scenario

CHANGES = ("executor", "threads", "duration", "depth", "period", "phase", "reacts")
"""Kinds of changes."""
KINDS = ("humble", "jazzy", "rclpy")
"""What systems run."""
# Releases whose traces declare links.
_LAYOUTS = {"humble": "humble-cyclonedds", "jazzy": "rolling", "rclpy": "rolling"}


@dataclass
class _Member:
    """A node to be: what it hears, and what it says how often [1/s]."""

    name: str
    inputs: list[str]
    output: str
    rates: list[float]
    period_ms: float = 0.0
    work_ms: float = 0.0
    link: str = ""


def replayed(seed: int) -> Scenario:
    """Return a system of its own for each seed."""
    random = Random(f"replayed {seed}")
    kind = KINDS[seed % len(KINDS)]
    members = _members(random)
    processes = []
    number = 0
    while members:
        size = min(len(members), random.choice([1, 1, 2, 3, 4, 6]))
        group, members = members[:size], members[size:]
        chosen = "single_threaded"
        if kind != "rclpy":
            chosen = random.choice(["single_threaded"] * 3 + ["multi_threaded", "events"])
        threads = random.choice([2, 3, 4]) if chosen == "multi_threaded" else 1
        _load(group, random.uniform(0.05, 0.95), random)
        processes.append(
            Process(
                f"process_{number}",
                "alpha",
                1000 + 20 * number,
                tuple(_node(each, random) for each in group),
                start_ns=random.randrange(200) * MILLISECOND,
                executors=(Executor(chosen, threads),),
                client_library="traced_rclpy" if kind == "rclpy" else "rclcpp",
            )
        )
        number += 1
    return Scenario(
        name=f"replayed_{seed}",
        description="A system to be replayed.",
        hosts=(Host("alpha", cpu_count=64),),
        processes=tuple(processes),
        duration_ns=10 * SECOND,
        layout=_LAYOUTS[kind],
        overwrites=True,
    )


def _members(random: Random) -> list[_Member]:
    count = random.randint(4, 40)
    members: list[_Member] = []
    rates: dict[str, float] = {}
    for number in range(count):
        name, output = f"node_{number}", f"/topic_{number}"
        if number < max(1, count // 4):
            period = random.choice([10.0, 20.0, 33.0, 40.0, 50.0, 100.0, 200.0])
            member = _Member(name, [], output, [], period)
            rates[output] = 1000 / period
        else:
            known = [each for each in members if each.output]
            sources = random.sample(known, min(len(known), random.choice([1, 1, 1, 2])))
            inputs = [each.output for each in sources]
            member = _Member(name, inputs, output, [rates[each] for each in inputs])
            rates[output] = member.rates[0]
            if random.random() < 0.15:
                member.link, member.period_ms = "periodic_async", random.choice([20.0, 50.0, 100.0])
                rates[output] = 1000 / member.period_ms
            elif len(inputs) == 2 and random.random() < 0.5:
                member.link = "partial_sync"
                rates[output] = min(member.rates)
            elif random.random() < 0.15:
                member.output = ""
        members.append(member)
    random.shuffle(members)
    return members


def _load(group: list[_Member], share: float, random: Random) -> None:
    """Give callbacks so much to do that together they need a share of a thread."""
    weights = [random.uniform(0.2, 1) for _ in group]
    for each, weight in zip(group, weights, strict=True):
        rate = 1000 / each.period_ms if each.period_ms else sum(each.rates)
        each.work_ms = min(50.0, 1000 * share * weight / sum(weights) / rate)


def _node(member: _Member, random: Random) -> Node:
    typical = int(member.work_ms * MILLISECOND)
    work = Work(int(0.85 * typical), int(0.3 * typical))
    if random.random() < 0.2:
        work = replace(work, slow_probability=0.05, slow_ns=2 * typical)
    outputs = (member.output,) if member.output else ()
    is_timed = bool(member.period_ms)
    keeping = Work(20_000, 30_000)
    depth = random.choice([1, 2, 5, 10])
    links: tuple[MessageLink, ...] = ()
    if member.link and outputs:
        links = (MessageLink(member.link, tuple(member.inputs), outputs),)
    return Node(
        member.name,
        publishers=tuple(Publisher(topic) for topic in outputs),
        subscriptions=tuple(
            Subscription(
                topic,
                outputs if not is_timed and (not number or member.link == "partial_sync") else (),
                keeping if is_timed else work,
                depth=depth,
            )
            for number, topic in enumerate(member.inputs)
        ),
        timers=(Timer(int(member.period_ms * MILLISECOND), outputs, work),) if is_timed else (),
        links=links,
    )


def changes_of(
    scenario: Scenario, random: Random, places: int = 2
) -> Iterator[tuple[Change, Scenario]]:
    """Yield changes that make sense, so many of each kind, with the system that has each."""
    for kind in CHANGES:
        chosen = [
            (process, node)
            for process in scenario.processes
            for node in process.nodes
            if _may_change(kind, process, node)
        ]
        for process, node in random.sample(chosen, min(places, len(chosen))):
            value, made = _MADE[kind](process, node)
            processes = tuple(made if each is process else each for each in scenario.processes)
            yield Change(kind, node.full_name, value), replace(scenario, processes=processes)


def _may_change(kind: str, process: Process, node: Node) -> bool:
    if kind == "executor":
        return len(process.nodes) > 1
    if kind == "threads":
        return process.client_library == "rclcpp" and (
            process.executors[0].kind == "single_threaded" and len(process.nodes) > 1
        )
    if kind == "depth":
        return any(each.depth > 1 for each in node.subscriptions)
    if kind == "period":
        return bool(node.timers)
    if kind == "phase":
        # The whole process starts later.
        return bool(node.timers) and sum(len(each.timers) for each in process.nodes) == 1
    if kind == "reacts":
        return any(each.kind == "periodic_async" for each in node.links)
    return True


def _with(process: Process, node: Node, changed: Node) -> Process:
    nodes = tuple(changed if each is node else each for each in process.nodes)
    return replace(process, nodes=nodes)


def _own_executor(process: Process, node: Node) -> tuple[float, Process]:
    kind = process.executors[0].kind
    changed = _with(process, node, replace(node, executor=1))
    own = Executor("events" if kind == "events" else "single_threaded")
    return 1, replace(changed, executors=(*process.executors, own))


def _threads(process: Process, _: Node) -> tuple[float, Process]:
    return 2, replace(process, executors=(Executor("multi_threaded", 2),))


def _duration(process: Process, node: Node) -> tuple[float, Process]:
    subscriptions = tuple(
        replace(each, work=replace(each.work, paces=((0, 0.7),))) for each in node.subscriptions
    )
    timers = tuple(
        replace(each, work=replace(each.work, paces=((0, 0.7),))) for each in node.timers
    )
    return 0.7, _with(process, node, replace(node, subscriptions=subscriptions, timers=timers))


def _depth(process: Process, node: Node) -> tuple[float, Process]:
    subscriptions = tuple(replace(each, depth=1) for each in node.subscriptions)
    return 1, _with(process, node, replace(node, subscriptions=subscriptions))


def _period(process: Process, node: Node) -> tuple[float, Process]:
    (timer,) = node.timers
    period = timer.period_ns * 3 // 2
    return period, _with(process, node, replace(node, timers=(replace(timer, period_ns=period),)))


def _phase(process: Process, node: Node) -> tuple[float, Process]:
    later = node.timers[0].period_ns * 2 // 5
    return later, replace(process, start_ns=process.start_ns + later)


def _reacts(process: Process, node: Node) -> tuple[str, Process]:
    """What its timer does is done at the end of each message of its first topic."""
    (timer,) = node.timers
    first, *others = node.subscriptions
    work = replace(timer.work, typical_ns=timer.work.typical_ns + first.work.typical_ns)
    changed = replace(
        node,
        timers=(),
        links=(),
        subscriptions=(replace(first, publishes=timer.publishes, work=work), *others),
    )
    return first.topic, _with(process, node, changed)


_MADE: dict[str, Callable[[Process, Node], tuple[float | str, Process]]] = {
    "executor": _own_executor,
    "threads": _threads,
    "duration": _duration,
    "depth": _depth,
    "period": _period,
    "phase": _phase,
    "reacts": _reacts,
}
