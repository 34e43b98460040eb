"""Random numbers belong to objects, so that a change leaves those of all others alone; order."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from itertools import groupby

import pyarrow.parquet as pq
import pytest

from msgflow_sim import (
    Executor,
    Host,
    Node,
    Process,
    Publisher,
    Scenario,
    Subscription,
    Timer,
    Work,
    simulate,
)
from msgflow_sim.entity import MILLISECOND
from msgflow_sim.executor import CallbackGroup
from msgflow_sim.executor import Executor as RunningExecutor
from msgflow_sim.scheduler import Scheduler

_SOURCE = Node(
    "source",
    publishers=(Publisher("/said"),),
    timers=(Timer(10 * MILLISECOND, ("/said",), Work(MILLISECOND, MILLISECOND)),),
)
_SLOW = Node("slow", subscriptions=(Subscription("/said", work=Work(4_000_000, 3_000_000)),))
_LATE = Node("late", subscriptions=(Subscription("/said", work=Work(100_000, 900_000)),))


def _system(*nodes: Node, executors: int) -> Scenario:
    pair = Process("pair", "alpha", 1201, nodes, executors=(Executor(),) * executors)
    source = Process("source", "alpha", 1101, (_SOURCE,))
    return Scenario("changed", "Two nodes.", (Host("alpha"),), (source, pair))


def _durations(scenario, folder):
    truth = simulate(scenario, folder, factor=0.05).truth["callback_instance"]
    taken = defaultdict(list)
    for row in sorted(pq.read_table(truth).to_pylist(), key=lambda row: row["start_ns"]):
        if row["end_ns"] is not None and row["node"] in {"/source", "/slow", "/late"}:
            taken[row["callback_handle"], row["node"]].append(row["end_ns"] - row["start_ns"])
    return {key: taken[key] for key in taken if len(taken[key]) > 30}


def test_a_change_leaves_what_callbacks_draw_alone(tmp_path):
    before = _durations(_system(_SLOW, _LATE, executors=1), tmp_path / "one")
    other = replace(_LATE, executor=1)
    after = _durations(_system(_SLOW, other, executors=2), tmp_path / "two")
    assert len(before) == 3
    assert before == after
    # Another seed draws other numbers.
    assert len({duration for each in before.values() for duration in each}) > 90


@dataclass(eq=False)
class _Entity:
    kind: str
    group: CallbackGroup
    name: str
    random: object
    due: int = 0

    def is_ready(self, _: int) -> bool:
        return True


def _order(seed, *, is_rclcpp=True, is_hashed=False):
    """In which order three nodes, each with two subscriptions and a timer, are executed."""
    scheduler = Scheduler(str(seed), None)
    executor = RunningExecutor(
        scheduler.dice("executor"),
        Executor(),
        is_rclcpp=is_rclcpp,
        is_traced=True,
        is_hashed=is_hashed,
    )
    for node in "abc":
        place = scheduler.dice(node)()
        group = CallbackGroup(place=place, node_place=place)
        for kind in ("subscription", "subscription", "timer"):
            executor.add(_Entity(kind, group, node, scheduler.dice(node, kind)))
    made = [entity for entities in (executor.timers, executor.subscriptions) for entity in entities]
    numbers = {entity: number for number, entity in enumerate(made)}
    executor.collect(0)
    return [(each.kind, each.name, numbers[each]) for each in iter(lambda: executor.pick(0), None)]


@pytest.mark.parametrize("seed", range(5))
def test_a_map_of_groups_keeps_the_order_of_creation_in_each(seed):
    order = _order(seed)
    assert [kind for kind, _ in groupby(order, key=lambda each: each[0])] == [
        "timer",
        "subscription",
    ]
    subscriptions = order[3:]
    assert len([*groupby(name for _, name, _ in subscriptions)]) == 3
    for _, group in groupby(subscriptions, key=lambda each: each[1]):
        numbers = [number for *_, number in group]
        assert numbers == sorted(numbers)


def test_the_order_is_another_one_in_each_process():
    for hashed in (False, True):
        orders = {tuple(_order(seed, is_hashed=hashed)) for seed in range(20)}
        assert len(orders) > 3


def test_a_hash_map_mixes_nodes_and_what_they_created():
    orders = [_order(seed, is_hashed=True)[3:] for seed in range(20)]
    assert any(len([*groupby(name for _, name, _ in each)]) > 3 for each in orders)
    assert all({kind for kind, *_ in each} == {"subscription"} for each in orders)


@pytest.mark.parametrize("seed", range(3))
def test_rclpy_goes_node_by_node(seed):
    order = _order(seed, is_rclcpp=False)
    assert len([*groupby(name for _, name, _ in order)]) == 3
    kinds = [kind for kind, *_ in order]
    assert kinds == ["timer", "subscription", "subscription"] * 3


@pytest.mark.parametrize(
    ("is_rclcpp", "is_hashed", "left"),
    [(True, False, 9), (True, True, 3), (False, True, 0)],
)
def test_who_forgets_what_is_ready_in_a_busy_group(is_rclcpp, is_hashed, left):
    group = CallbackGroup(is_busy=True)
    executor = RunningExecutor(
        Scheduler("0", None).dice("executor"),
        Executor(),
        is_rclcpp=is_rclcpp,
        is_traced=True,
        is_hashed=is_hashed,
    )
    for kind in ("subscription", "service", "timer") * 3:
        executor.add(_Entity(kind, group, "a", lambda: 0.5))
    executor.collect(0)
    assert executor.pick(0) is None
    group.is_busy = False
    assert len([*iter(lambda: executor.pick(0), None)]) == left
