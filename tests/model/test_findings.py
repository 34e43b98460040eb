"""Findings of the input."""

from __future__ import annotations

from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread


def test_none_says_that_there_is_nothing(system: RosSystem, analyse: Analyse) -> None:
    """Several traces, so that packets and ids could be of more than one."""
    for trace in range(2):
        system.add_source(trace, f"host {trace}", f"boot {trace}")
        system.publish(Thread(100, trace=trace), 0x10, 1)
    model = analyse(system)
    assert model.value("SELECT count(*) FROM store.clock") == 2
    assert model.rows("SELECT name FROM store.finding WHERE coalesce(count, 0) = 0") == []
