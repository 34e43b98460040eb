"""The queries changes and loops on a simulated system in which several things change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from support.ingested import ingest_one
from support.robots import alone, robot

import msgflow
from msgflow.errors import UsageError
from msgflow_sim import (
    Host,
    Node,
    Publisher,
    Recording,
    Scenario,
    Subscription,
    Timer,
    Work,
    simulate,
)
from msgflow_sim.entity import MILLISECOND, SECOND

SECONDS = 20
# When what changes, in seconds.
SLOWER, FASTER, CANCELLED, KILLED, LOSSY, SLOWER_TIMER = 7.3, 14.2, 6.1, 11.6, 9.4, 12.7
BURST, OVERLOADED = 10.2, 8.3


def system(*, changes: bool) -> Scenario:
    """Sensors with a reader each; of some readers or sensors something changes."""

    def at(seconds: float) -> int:
        return int((seconds if changes else 2 * SECONDS) * SECOND)

    growing = tuple((at(0.1 * step), 1 + 0.02 * step) for step in range(10 * SECONDS))
    readers = {
        "slower": Work(5 * MILLISECOND, MILLISECOND, paces=((at(SLOWER), 2), (at(FASTER), 1))),
        "growing": Work(4 * MILLISECOND, MILLISECOND, paces=growing),
        "lossy": Work(MILLISECOND),
        "steady": Work(3 * MILLISECOND, 9 * MILLISECOND),
        "killed": Work(2 * MILLISECOND),
        "cancelled": Work(2 * MILLISECOND),
        "slower_timer": Work(2 * MILLISECOND),
        "bursty": Work(MILLISECOND),
        "overloaded": Work(9 * MILLISECOND, paces=((at(OVERLOADED), 5),)),
    }
    periods = {
        "cancelled": ((at(CANCELLED), 0),),
        "slower_timer": ((at(SLOWER_TIMER), 60 * MILLISECOND),),
        # 12 messages in place of one.
        "bursty": ((at(BURST), 3 * MILLISECOND), (at(BURST + 0.04), 40 * MILLISECOND)),
    }
    processes = []
    for number, (name, work) in enumerate(readers.items()):
        sensor = Node(
            f"{name}_sensor",
            publishers=(Publisher(f"/{name}"),),
            timers=(Timer(40 * MILLISECOND, (f"/{name}",), Work(), periods=periods.get(name, ())),),
        )
        reader = Node(
            name,
            publishers=(Publisher(f"/{name}_result"),),
            subscriptions=(
                Subscription(
                    f"/{name}",
                    (f"/{name}_result",),
                    work,
                    loss=0.4 if name == "lossy" else 0,
                    loss_from_ns=at(LOSSY),
                ),
            ),
        )
        killed = {"stop_ns": at(KILLED), "is_killed": True} if name == "killed" and changes else {}
        pid = 1000 + 100 * number
        processes += [alone(sensor, pid), alone(reader, pid + 50, **killed)]
    return robot(
        *processes,
        name="changes",
        hosts=(Host("robot", cpu_count=16),),
        duration_ns=SECONDS * SECOND,
        layout="kilted",
        overwrites=True,
        recording=Recording(),
    )


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The database of the system in which several things change."""
    return simulated(tmp_path_factory.mktemp("changed"), system(changes=True))


@pytest.fixture(scope="module")
def changed(recorded: Path) -> list[dict[str, Any]]:
    """Rows of the query, with the time since the begin of the recording [s]."""
    return asked(recorded)


def simulated(folder: Path, scenario: Scenario) -> Path:
    simulate(scenario, folder / "trace")
    ingest_one(folder / "trace", folder / "run.duckdb")
    return folder / "run.duckdb"


def asked(database: Path) -> list[dict[str, Any]]:
    with msgflow.open_db(database) as opened:
        rows = opened.query("changes").table.to_pylist()
        begin = opened.sql("SELECT min(start_ns) AS ns FROM run").table["ns"][0].as_py()
    return [row | {"at": (row["at_ns"] - begin) / SECOND} for row in rows]


def rows_of(
    rows: list[dict[str, Any]], kind: str, what: str, node: str | None
) -> list[dict[str, Any]]:
    return [row for row in rows if (row["kind"], row["what"], row["node"]) == (kind, what, node)]


def test_nothing_changes_where_nothing_does(tmp_path: Path) -> None:
    assert asked(simulated(tmp_path, system(changes=False))) == []


def test_a_callback_that_takes_longer_for_a_while_steps_up_and_down(
    changed: list[dict[str, Any]],
) -> None:
    up, down = rows_of(changed, "step", "duration", "/slower")
    assert up["at"] == pytest.approx(SLOWER, abs=0.1)
    assert down["at"] == pytest.approx(FASTER, abs=0.1)
    assert up["before"] == pytest.approx(5.5e6, rel=0.05)
    assert up["after"] == pytest.approx(11e6, rel=0.05)
    assert " ms → 1" in up["change"]
    assert up["certainty"] > 0.95
    assert not up["follows"]
    # The path through it is later by as much, since it takes longer.
    path, *_ = [row for row in changed if row["what"] == "latency" and "/slower " in row["subject"]]
    assert path["follows"] == "duration Subscription(/slower) of /slower"


def test_what_grows_all_the_time_is_a_trend_and_no_step(changed: list[dict[str, Any]]) -> None:
    (trend,) = rows_of(changed, "trend", "duration", "/growing")
    assert trend["after"] / trend["before"] == pytest.approx(4, rel=0.15)
    # 0.02 of 4.5 ms each 0.1 s.
    assert trend["low"] < 0.2 * 4.5e6 < trend["high"]
    assert not rows_of(changed, "step", "duration", "/growing")


def test_a_cancelled_timer_stops_and_its_topic_follows(changed: list[dict[str, Any]]) -> None:
    (timer,) = rows_of(changed, "stop", "timer", "/cancelled_sensor")
    assert timer["at"] == pytest.approx(CANCELLED, abs=0.05)
    assert timer["count"] == pytest.approx((SECONDS - CANCELLED) / 0.04, abs=5)
    assert not timer["follows"]
    (topic,) = rows_of(changed, "stop", "topic", "/cancelled_sensor")
    assert topic["follows"] == "timer Timer(40 ms) of /cancelled_sensor"
    (result,) = rows_of(changed, "stop", "topic", "/cancelled")
    assert result["follows"] == "topic /cancelled of /cancelled_sensor"


def test_a_node_that_dies_is_named(changed: list[dict[str, Any]]) -> None:
    (result,) = rows_of(changed, "stop", "topic", "/killed")
    assert result["at"] == pytest.approx(KILLED, abs=0.1)
    assert result["since"] == "/killed is not seen any more"
    assert not result["follows"]
    assert not rows_of(changed, "stop", "topic", "/killed_sensor")


def test_losses_begin(changed: list[dict[str, Any]]) -> None:
    (loss,) = rows_of(changed, "step", "loss", "/lossy")
    assert loss["at"] == pytest.approx(LOSSY, abs=1)
    assert loss["before"] == 0
    assert loss["after"] == pytest.approx(0.4, abs=0.15)


def test_a_timer_gets_another_period(changed: list[dict[str, Any]]) -> None:
    (timer,) = rows_of(changed, "step", "timer", "/slower_timer_sensor")
    assert timer["at"] == pytest.approx(SLOWER_TIMER, abs=0.1)
    assert (timer["before"], timer["after"]) == pytest.approx((40e6, 60e6), rel=0.01)


def test_what_does_not_change_has_no_row(changed: list[dict[str, Any]]) -> None:
    assert not [row for row in changed if "/steady" in f"{row['node']} {row['subject']}"]


def test_more_messages_than_usual_are_a_burst(changed: list[dict[str, Any]]) -> None:
    (topic,) = rows_of(changed, "burst", "topic", "/bursty_sensor")
    assert topic["at"] == pytest.approx(BURST, abs=0.1)
    assert topic["change"] == "40 ms → 3 ms"
    assert topic["count"] == pytest.approx(12, abs=2)
    assert topic["follows"] == "timer Timer(40 ms) of /bursty_sensor"


def test_a_queue_grows_since_its_callback_takes_longer(changed: list[dict[str, Any]]) -> None:
    (queue,) = rows_of(changed, "step", "queue", "/overloaded")
    assert queue["at"] > OVERLOADED
    assert queue["after"] == pytest.approx(10, abs=1)
    assert queue["follows"] == "duration Subscription(/overloaded) of /overloaded"
    assert not [row for row in changed if "overloaded" in str(row["node"]) and not row["follows"]][
        1:
    ]


def test_a_moment_has_what_changed_ran_and_was_slow(recorded: Path) -> None:
    with msgflow.open_db(recorded) as opened:
        moment = opened.why(at=f"{SLOWER + 0.3}s")
        calm = opened.why(at="4s")
    said = f"since {SLOWER:.1f} s: duration of Subscription(/slower) of /slower: 5.4"
    assert moment.headline.startswith(said)
    (duration, *_) = moment.sections["changes"].table.to_pylist()
    assert (duration["what"], duration["node"]) == ("duration", "/slower")
    ran = {row["node"]: row for row in moment.sections["callbacks"].table.to_pylist()}
    assert ran["/slower"]["count"] == 25
    assert ran["/slower"]["longest_ns"] > 1.5 * 5.5e6
    paths = moment.sections["paths"].table.to_pylist()
    (silent,) = (row for row in paths if "/cancelled " in row["path"])
    assert silent["flows"] == 0
    (slow,) = (row for row in paths if "/slower " in row["path"])
    assert slow["median_ns"] > 1.5 * slow["usual_ns"]
    assert moment.steps == (("query", "critical-path", "--start", "7.1s", "--end", "8.1s"),)
    # What grows all the time does so at any moment.
    assert "/growing" in calm.headline
    with msgflow.open_db(recorded) as opened, pytest.raises(UsageError, match="no such moment"):
        opened.why(at="90s")
