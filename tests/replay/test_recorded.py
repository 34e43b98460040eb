"""When messages came, as far as the waits of an executor tell; and what a replay makes of it."""

from __future__ import annotations

from typing import Any

import pytest

from msgflow.replay.draw import Lottery
from msgflow.replay.engine import Replay
from msgflow.replay.recorded import recorded_system
from msgflow.replay.system import Callback, Executor, Instance, Sent, System

_TIMER, _HEARS, _OTHER = 1, 2, 3
_MESSAGE = 7


def _instance(number: int, callback: int, wait: int, end: int, **more: Any) -> dict[str, Any]:
    return {
        "callback_instance_id": number,
        "callback_id": callback,
        "executor_id": 1,
        "thread_id": 1,
        "start_ns": end + 5,
        "end_ns": end + 50,
        "looked_ns": end,
        "wait_ns": wait,
        "round_ns": end,
        "before_ns": None,
        "next_ns": end + 55,
        "publication_id": None,
        **more,
    }


def _callback(number: int, kind: str, **more: Any) -> dict[str, Any]:
    return {
        "callback_id": number,
        "executor_id": 1,
        "kind": kind,
        "node": "/node",
        "label": kind,
        "symbol": None,
        "subscription_id": None,
        "queue_depth": 10,
        "period_ns": None,
        "created_ns": None,
        "is_python": False,
        "callback_group_id": None,
        "is_reentrant": None,
        **more,
    }


def _delay(wait: int, end: int, *others: dict[str, Any], threads: int = 1) -> int:
    """How long a message of 2100 travels to a callback that a wait finds; timers wake in 10."""
    instances = [
        *(_instance(each, _TIMER, 1000 * each - 500, 1000 * each + 10) for each in (1, 2)),
        *others,
        _instance(8, _HEARS, wait, end, publication_id=_MESSAGE),
    ]
    tables = {
        "replay_instance": instances,
        "replay_executor": [
            {
                "executor_id": 1,
                "kind": "multi_threaded" if threads > 1 else "single_threaded",
                "threads": threads,
                "has_rounds": True,
                "start_ns": 0,
                "falling_ns": 1,
            }
        ],
        "replay_callback": [
            _callback(_TIMER, "timer", node="/clock", period_ns=1000, created_ns=0),
            _callback(_HEARS, "subscription", subscription_id=4),
            _callback(_OTHER, "service"),
        ],
        "replay_order": [],
        "replay_publication": [
            {
                "publication_id": _MESSAGE,
                "publisher_id": 5,
                "start_ns": 2095,
                "end_ns": 2100,
                "callback_instance_id": None,
            }
        ],
        "replay_delivery": [
            {
                "publication_id": _MESSAGE,
                "subscription_id": 4,
                "callback_instance_id": 8,
                "arrived_ns": None,
            }
        ],
        "replay_annotation": [],
        "replay_path": [],
        "fleet_flow": [],
    }
    system = recorded_system(tables, (0, 5000))
    assert (system.executors[1].waking, system.executors[1].polling) == (10, 10)
    ((_, sent),) = system.outside
    return sent.delays[_HEARS]


def test_a_message_that_ends_a_long_wait_came_right_before_its_end():
    assert _delay(2105, 2400) == 290
    # So short a wait may have found it when it began.
    assert _delay(2105, 2140) == 0
    assert _delay(2105, 2150) == 40


def test_while_others_of_its_group_run_a_message_ends_no_wait():
    beside = _instance(7, _OTHER, 2070, 2080, thread_id=2, end_ns=2300)
    assert _delay(2105, 2400, beside, threads=2) == 0
    before = _instance(7, _OTHER, 2010, 2020, thread_id=2)
    assert _delay(2105, 2400, before, threads=2) == 290


def _replayed_system(delay: int) -> System:
    """A timer at 1000 publishes to a callback of the same executor."""
    sent = Sent(10, 5, _MESSAGE, {_HEARS: delay})
    timer = Callback(
        _TIMER, "timer", "/node", "timer", 1, None, 0, None, 1000, 1000, 1000,
        instances={0: Instance(1000, 0, 20, 0, None, [sent])},
    )  # fmt: skip
    hears = Callback(
        _HEARS, "subscription", "/node", "hears", 1, 4, 10, None,
        instances={_MESSAGE: Instance(1010, 0, 20, 0)},
    )  # fmt: skip
    executor = Executor("single_threaded", False, False, 1, 0, 1, 100, 7)
    return System({1: executor}, {_TIMER: timer, _HEARS: hears}, [], [], {}, {}, {}, {}, {}, 5000)


@pytest.mark.parametrize(
    ("delay", "begin"),
    [
        # It is there when the wait begins at 1121; or the thread has to wake up.
        (5, 1121 + 7),
        (300, 1110 + 300 + 100),
    ],
)
def test_what_is_there_when_a_wait_begins_ends_it_at_once(delay, begin):
    replay = Replay(_replayed_system(delay))
    replay.latencies()
    timer, hears = replay.ran
    assert timer[2:4] == (1100, 1120)
    assert hears[2] == begin
    assert replay.loads() == {1: 40 / 5000}


def test_the_same_seed_draws_the_same_run():
    lottery = Lottery(_replayed_system(5))
    one, again, other = (lottery.draw(seed).callbacks[_TIMER].origin for seed in (1, 1, 2))
    assert one == again != other
