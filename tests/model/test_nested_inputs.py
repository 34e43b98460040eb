"""Inputs of partial synchronous links that a spinning callback takes in itself, on one thread."""

from __future__ import annotations

import pytest
from analysis import Analyse
from ros_system import RosSystem
from staged_events import Thread

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


def test_a_message_that_was_there_before_may_be_the_one(merge: RosSystem, analyse: Analyse) -> None:
    begin(merge, B, 9)
    merge.end(NODE, B)
    begin(merge, A, 10)
    begin(merge, B, 11)
    merge.end(NODE, B)
    merge.publish(NODE, 0x21, 12)
    merge.end(NODE, A)
    assert analyse(merge).rows(LINKS) == [(11, 12, 2)]
