"""Inputs of partial synchronous links that a spinning callback takes in itself, on one thread."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

NODE = Thread(100)
A, B = 0xCA, 0xCB
LINKS = (
    "SELECT t.source_timestamp_ns, b.source_timestamp_ns, l.candidate_count FROM link_causal AS l "
    "JOIN take AS t ON l.take_id = t.take_id JOIN publication AS b USING (publication_id) "
    "WHERE l.kind = 'partial_sync' ORDER BY ALL"
)


@pytest.fixture
def merge(system: RosSystem) -> RosSystem:
    """A node that merges /a and /b into /out."""
    system.context(NODE)
    system.node(NODE, 0x1, "merge")
    system.subscription(NODE, 0x11, "/a", callback=A)
    system.subscription(NODE, 0x12, "/b", callback=B)
    system.publisher(NODE, 0x21, "/out")
    system.annotate(NODE, "partial_sync", [0x11, 0x12], [0x21])
    return system


def begin(system: RosSystem, callback: int, stamp: int) -> None:
    """The callback of /a or /b begins with a message."""
    system.take(NODE, 0x11 if callback == A else 0x12, stamp)
    system.start(NODE, callback)


def test_what_ran_nested_is_used_by_what_it_ran_in(merge: RosSystem, analyse: Analyse) -> None:
    for n in (10, 20, 30):
        begin(merge, A, n)
        begin(merge, B, n + 1)
        merge.end(NODE, B)
        merge.publish(NODE, 0x21, n + 2)
        merge.end(NODE, A)
    assert analyse(merge).rows(LINKS) == [(11, 12, 1), (21, 22, 1), (31, 32, 1)]


@pytest.mark.thorough
def test_and_by_no_later_firing(merge: RosSystem, analyse: Analyse) -> None:
    """What is published before the other input came has no message of it."""
    for n in (10, 20):
        begin(merge, A, n)
        merge.publish(NODE, 0x21, n + 2)
        begin(merge, B, n + 1)
        merge.end(NODE, B)
        merge.publish(NODE, 0x21, n + 3)
        merge.end(NODE, A)
    assert analyse(merge).rows(LINKS) == [(11, 13, 1), (21, 23, 1)]


def test_what_came_after_the_last_publication_is_kept(merge: RosSystem, analyse: Analyse) -> None:
    begin(merge, A, 10)
    begin(merge, B, 11)
    merge.end(NODE, B)
    merge.publish(NODE, 0x21, 12)
    begin(merge, B, 13)
    merge.end(NODE, B)
    merge.end(NODE, A)
    begin(merge, A, 20)
    merge.publish(NODE, 0x21, 22)
    merge.end(NODE, A)
    assert analyse(merge).rows(LINKS) == [(11, 12, 1), (13, 22, 1)]


@pytest.mark.thorough
def test_what_a_firing_runs_in_has_not_ended(merge: RosSystem, analyse: Analyse) -> None:
    """Also if there is another callback between the two."""
    merge.timer(NODE, 0x31, callback=0xCC)
    begin(merge, A, 10)
    begin(merge, B, 11)
    merge.publish(NODE, 0x21, 12)
    merge.end(NODE, B)
    merge.start(NODE, 0xCC)
    begin(merge, B, 13)
    merge.publish(NODE, 0x21, 14)
    merge.end(NODE, B)
    merge.end(NODE, 0xCC)
    merge.end(NODE, A)
    assert analyse(merge).rows(LINKS) == []


@pytest.mark.thorough
def test_nested_deeper(merge: RosSystem, analyse: Analyse) -> None:
    merge.timer(NODE, 0x31, callback=0xCC)
    for n in (10, 20):
        begin(merge, A, n)
        merge.publish(NODE, 0x21, n + 2)
        merge.start(NODE, 0xCC)
        begin(merge, B, n + 1)
        merge.end(NODE, B)
        merge.end(NODE, 0xCC)
        merge.publish(NODE, 0x21, n + 3)
        merge.end(NODE, A)
    assert analyse(merge).rows(LINKS) == [(11, 13, 1), (21, 23, 1)]


@pytest.mark.thorough
def test_a_message_that_was_there_before_may_be_the_one(merge: RosSystem, analyse: Analyse) -> None:
    begin(merge, B, 9)
    merge.end(NODE, B)
    begin(merge, A, 10)
    begin(merge, B, 11)
    merge.end(NODE, B)
    merge.publish(NODE, 0x21, 12)
    merge.end(NODE, A)
    assert analyse(merge).rows(LINKS) == [(11, 12, 2)]


@pytest.mark.thorough
def test_other_firings_may_have_used_what_a_firing_did_not(
    merge: RosSystem, analyse: Analyse
) -> None:
    """It ran nested behind the last publication: a firing on another thread may have seen it."""
    other = Thread(100, 101)
    begin(merge, A, 10)
    begin(merge, B, 11)
    merge.end(NODE, B)
    merge.publish(NODE, 0x21, 12)
    merge.take(other, 0x11, 20)
    merge.start(other, A)
    begin(merge, B, 13)
    merge.end(NODE, B)
    merge.publish(other, 0x21, 22)
    merge.end(other, A)
    merge.end(NODE, A)
    assert analyse(merge).rows(LINKS) == [(11, 12, 1), (13, 22, 2)]


@pytest.mark.thorough
def test_used_by_one_annotation(merge: RosSystem, analyse: Analyse) -> None:
    """It may be there for the other. And a timer uses nothing."""
    other = Thread(100, 101)
    merge.subscription(NODE, 0x13, "/c", callback=0xCD)
    merge.publisher(NODE, 0x22, "/second")
    merge.annotate(NODE, "partial_sync", [0x12, 0x13], [0x22])
    merge.timer(NODE, 0x31, callback=0xCC)
    merge.take(other, 0x13, 20)
    merge.start(other, 0xCD)
    begin(merge, A, 10)
    begin(merge, B, 11)
    merge.end(NODE, B)
    merge.publish(NODE, 0x21, 12)
    merge.end(NODE, A)
    merge.publish(other, 0x22, 22)
    merge.end(other, 0xCD)
    merge.take(other, 0x13, 30)
    merge.start(other, 0xCD)
    merge.start(NODE, 0xCC)
    begin(merge, B, 33)
    merge.end(NODE, B)
    merge.end(NODE, 0xCC)
    merge.publish(other, 0x22, 32)
    merge.end(other, 0xCD)
    assert analyse(merge).rows(LINKS) == [(11, 12, 1), (11, 22, 2), (33, 32, 3)]


@pytest.mark.thorough
def test_nested_in_what_is_no_input(merge: RosSystem, analyse: Analyse) -> None:
    """The message came meanwhile on another thread: that has ended."""
    other = Thread(100, 101)
    merge.timer(NODE, 0x31, callback=0xCC)
    merge.start(NODE, 0xCC)
    begin(merge, B, 11)
    merge.take(other, 0x11, 20)
    merge.start(other, A)
    merge.end(other, A)
    merge.publish(NODE, 0x21, 12)
    merge.end(NODE, B)
    merge.end(NODE, 0xCC)
    assert analyse(merge).rows(LINKS) == [(20, 12, 2)]


@pytest.mark.thorough
def test_what_another_instance_ran_in_has_ended(merge: RosSystem, analyse: Analyse) -> None:
    other = Thread(100, 101)
    begin(merge, B, 11)
    merge.take(other, 0x11, 20)
    merge.start(other, A)
    merge.take(other, 0x12, 21)
    merge.start(other, B)
    merge.end(other, B)
    merge.end(other, A)
    merge.publish(NODE, 0x21, 12)
    merge.end(NODE, B)
    assert analyse(merge).rows(LINKS) == [(20, 12, 2)]
