"""A timer or topic stops while msgflow watches: it says so once."""

from __future__ import annotations

import json
from pathlib import Path

from support.robots import alone, robot
from typer.testing import CliRunner

from msgflow.cli.app import app
from msgflow_sim import Node, Publisher, Recording, Subscription, Timer, simulate

MS = 1_000_000
SECOND = 1_000_000_000


def test_a_timer_that_is_cancelled_is_told_once(tmp_path: Path) -> None:
    """The other one of its node goes on; that of /ended stops with its process."""
    controller = Node(
        "controller",
        publishers=(Publisher("/cmd"), Publisher("/state")),
        timers=(
            Timer(40 * MS, publishes=("/cmd",), periods=((3 * SECOND, 0),)),
            Timer(50 * MS, publishes=("/state",)),
        ),
    )
    ended = Node(
        "ended",
        publishers=(Publisher("/extra"),),
        timers=(Timer(30 * MS, publishes=("/extra",)),),
    )
    sink = Node("sink", subscriptions=(Subscription("/cmd"), Subscription("/state")))
    parts = controller, alone(ended, 2001, stop_ns=4 * SECOND), sink
    scenario = robot(*parts, duration_ns=7 * SECOND, layout="rolling")
    recording = Recording(rotations=tuple(SECOND * n for n in range(1, 7)))
    simulate(scenario, tmp_path / "trace", recording=recording)
    words = ["watch", str(tmp_path / "trace"), "--once", "--window", "4s", "--step", "1s"]
    result = CliRunner().invoke(app, [*words, "--json"])
    windows = [json.loads(line) for line in result.stdout.splitlines()]
    (stopped,) = (row for window in windows for row in window["stopped"])
    assert (stopped["what"], stopped["subject"]) == ("timer", "/controller Timer(40 ms)")
    assert "and with it /cmd" in stopped["sentence"]
    # Well before the end of the recording.
    assert not windows[-1]["stopped"]
    said = CliRunner().invoke(app, words).stdout
    assert said.count("/controller Timer(40 ms) stopped: each 40 ms, then ") == 1
