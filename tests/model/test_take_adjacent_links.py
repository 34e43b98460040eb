"""Publications after a take by hand: rclpy, wait sets."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

SOURCE = Thread(100)
PYTHON = Thread(200, None, "python3")
SINK = Thread(300)
LINKS = (
    "SELECT b.source_timestamp_ns, t.source_timestamp_ns, l.kind, l.callback_instance_id "
    "FROM link_causal AS l JOIN publication AS b USING (publication_id) "
    "LEFT JOIN take AS t ON l.take_id = t.take_id ORDER BY b.publication_id"
)


@pytest.fixture
def relay(system: RosSystem) -> RosSystem:
    """SOURCE → /a → PYTHON → /b → SINK, the one in the middle without rclcpp."""
    system.publisher(SOURCE, 0x10, "/a")
    system.subscription(PYTHON, 0x20, "/a")
    system.publisher(PYTHON, 0x11, "/b")
    system.subscription(SINK, 0x21, "/b", callback=0xCB)
    return system


def test_until_the_next_take(relay: RosSystem, analyse: Analyse) -> None:
    relay.publish(PYTHON, 0x11, 1, layers="rcl rmw")
    relay.take(PYTHON, 0x20, 11, layers="rmw rcl")
    relay.publish(PYTHON, 0x11, 2, layers="rcl rmw")
    relay.publish(PYTHON, 0x11, 3, layers="rcl rmw")
    relay.take(PYTHON, 0x20, 12, layers="rmw rcl")
    relay.publish(PYTHON, 0x11, 4, layers="rcl rmw")
    relay.publish(Thread(200, 201), 0x11, 5, layers="rcl rmw")
    assert analyse(relay).rows(LINKS) == [
        (2, 11, "take_adjacent", None),
        (3, 11, "take_adjacent", None),
        (4, 12, "take_adjacent", None),
    ]


@pytest.mark.thorough
def test_a_run_of_a_callback_is_a_better_cause(relay: RosSystem, analyse: Analyse) -> None:
    """And after one has begun, or the executor went on, the message by hand is none."""
    relay.take(SINK, 0x21, 11)
    relay.start(SINK, 0xC1)
    relay.publish(SINK, 0x12, 1)
    relay.end(SINK, 0xC1)
    relay.publish(SINK, 0x12, 2)
    relay.take(SINK, 0x21, 12)
    relay.ready(SINK)
    relay.publish(SINK, 0x12, 3)
    assert [row[:3] for row in analyse(relay).rows(LINKS)] == [(1, 11, "direct")]


def test_not_across_a_gap(relay: RosSystem, analyse: Analyse) -> None:
    relay.take(PYTHON, 0x20, 11, layers="rmw rcl")
    relay.lose()
    relay.publish(PYTHON, 0x11, 2, layers="rcl rmw")
    assert analyse(relay).rows(LINKS) == []


@pytest.mark.thorough
def test_not_across_a_gap_that_began_before(relay: RosSystem, analyse: Analyse) -> None:
    """On a CPU that the thread may have visited."""
    taken = relay.take(PYTHON, 0x20, 11, layers="rmw rcl")
    published = relay.publish(PYTHON, 0x11, 2, layers="rcl rmw")
    relay.add_packet(0, 10_000, cpu=0)
    relay.add_packet(0, published - 1, last_event=taken - 100, discarded=3, cpu=1)
    assert analyse(relay).rows(LINKS) == []


@pytest.mark.thorough
def test_flows_pass_through(relay: RosSystem, analyse: Analyse) -> None:
    relay.publish(SOURCE, 0x10, 11)
    relay.take(PYTHON, 0x20, 11, layers="rmw rcl")
    relay.publish(PYTHON, 0x11, 12, layers="rcl rmw")
    relay.take(SINK, 0x21, 12)
    relay.start(SINK, 0xCB)
    relay.end(SINK, 0xCB)
    model = analyse(relay)
    assert model.rows(
        "SELECT from_kind, from_id, to_kind, to_id, link_kind FROM flow_edge ORDER BY from_ns"
    ) == [
        ("publication", 1, "take", 1, "transport"),
        ("take", 1, "publication", 2, "take_adjacent"),
        ("publication", 2, "take", 2, "transport"),
        ("take", 2, "callback_instance", 1, "callback"),
    ]
    assert model.rows("SELECT kind, id FROM flow_forward('publication', 1) ORDER BY kind, id") == [
        ("callback_instance", 1),
        ("publication", 1),
        ("publication", 2),
        ("take", 1),
        ("take", 2),
    ]
    assert model.rows(
        "SELECT h.topics, e.status, e.take_id FROM end_to_end([1], NULL, NULL, 'callback_start', "
        "'callback_end', 0, 9223372036854775807) AS e "
        "JOIN flow_path([1], NULL, NULL) AS h USING (path_id)"
    ) == [(["/a", "/b"], "reached", 2)]
    assert model.rows(
        "SELECT depth, kind, link_kind, wait_ns IS NOT NULL, missing "
        "FROM flow_step('publication', 1, direction := 'forward') ORDER BY depth"
    ) == [
        (0, "publication", None, False, None),
        (1, "take", "transport", True, None),
        (2, "publication", "take_adjacent", True, None),
        (3, "take", "transport", True, None),
        (4, "callback_instance", "callback", True, None),
    ]


@pytest.mark.thorough
def test_until_the_next_take_of_a_request_or_response(relay: RosSystem, analyse: Analyse) -> None:
    """A service of rclpy shows no callback either; what it publishes is not due to the message."""
    relay.take(PYTHON, 0x20, 11, layers="rmw rcl")
    relay.publish(PYTHON, 0x11, 1, layers="rcl rmw")
    relay.take_request(Thread(200, 201), 0x40, 1, gid=7)
    relay.publish(PYTHON, 0x11, 2, layers="rcl rmw")
    relay.take_request(PYTHON, 0x40, 2, gid=7, taken=0)
    relay.publish(PYTHON, 0x11, 3, layers="rcl rmw")
    relay.take_request(PYTHON, 0x40, 2, gid=7)
    relay.publish(PYTHON, 0x11, 4, layers="rcl rmw")
    relay.take(PYTHON, 0x20, 12, layers="rmw rcl")
    relay.publish(PYTHON, 0x11, 5, layers="rcl rmw")
    relay.take_response(PYTHON, 0x50, 1)
    relay.publish(PYTHON, 0x11, 6, layers="rcl rmw")
    assert [row[:2] for row in analyse(relay).rows(LINKS)] == [(1, 11), (2, 11), (3, 11), (5, 12)]


@pytest.mark.thorough
def test_the_middleware_answers_nothing(relay: RosSystem, analyse: Analyse) -> None:
    """Discovery publishes without a publisher of rcl, and no event of it was lost."""
    relay.take(PYTHON, 0x20, 11, layers="rmw rcl")
    relay.publish(PYTHON, 0x99, 1, layers="rmw")
    relay.publish(PYTHON, 0x11, 2, layers="rcl rmw")
    model = analyse(relay)
    assert model.rows("SELECT count(*) FROM publication WHERE publisher_id IS NULL") == [(1,)]
    assert [row[:2] for row in model.rows(LINKS)] == [(2, 11)]


MARKED = (
    "SELECT b.source_timestamp_ns, t.source_timestamp_ns, l.candidate_count "
    "FROM link_causal AS l JOIN publication AS b USING (publication_id) "
    "LEFT JOIN take AS t ON l.take_id = t.take_id ORDER BY b.publication_id"
)


@pytest.fixture
def asker(relay: RosSystem) -> RosSystem:
    """The one in the middle sends goals, too; it answered feedback before, and has no timer."""
    relay.node(PYTHON, 0x1, "asker")
    relay.client(PYTHON, 0x30, "/dock/_action/send_goal", gid=7)
    relay.subscription(PYTHON, 0x31, "/dock/_action/feedback")
    relay.subscription(PYTHON, 0x32, "/dock/_action/status")
    relay.publisher(PYTHON, 0x12, "/fed")
    relay.publisher(PYTHON, 0x13, "/done")
    relay.send_request(PYTHON, 0x30, 1)
    relay.take_request(SOURCE, 0x40, 1, gid=7)
    for stamp, apart in enumerate((1, 7, 2, 9, 30, 5), start=101):
        relay.take(PYTHON, 0x31, stamp, layers="rmw rcl")
        relay.publish(PYTHON, 0x12, stamp + 100, layers="rcl rmw")
        relay.wait(1_000 * apart)
    return relay


@pytest.mark.parametrize(
    ("events", "links"),
    [
        # The states of goals cause nothing.
        ("F P", [(1, 31, 1)]),
        ("F S P", [(1, 31, 1)]),
        ("S F P", [(1, 31, 1)]),
        # What waits for a response goes on behind what was ready with it.
        ("R P", []),
        ("R F P D", [(1, 31, 2), (2, 31, 2)]),
        ("F P R F P", [(1, 31, 1), (1, 31, 2)]),
    ],
)
def test_what_clients_of_actions_take_at_once(
    asker: RosSystem, analyse: Analyse, events: str, links: list[tuple[int, int, int]]
) -> None:
    for event in events.split():
        match event:
            case "F":
                asker.take(PYTHON, 0x31, 31, layers="rmw rcl")
            case "S":
                asker.take(PYTHON, 0x32, 32, layers="rmw rcl")
            case "R":
                asker.take_response(PYTHON, 0x30, 1)
            case "P":
                asker.publish(PYTHON, 0x12, 1, layers="rcl rmw")
            case "D":
                asker.publish(PYTHON, 0x13, 2, layers="rcl rmw")
    # It also publishes by itself: else each would be an answer.
    asker.publish(Thread(200, 201), 0x12, 0, layers="rcl rmw")
    assert analyse(asker).rows(MARKED)[6:] == links


@pytest.mark.parametrize(
    ("more", "count"), [("", 1), ("take", 1), ("take take", 2), ("publish", 2), ("other", 2)]
)
def test_each_message_has_its_answer(
    asker: RosSystem, analyse: Analyse, more: str, count: int
) -> None:
    """And nothing else is published: then a response changes nothing."""
    asker.take_response(PYTHON, 0x30, 1)
    asker.take(PYTHON, 0x31, 31, layers="rmw rcl")
    asker.publish(PYTHON, 0x12, 1, layers="rcl rmw")
    for one in more.split():
        asker.wait(50_000)
        if one != "publish":
            asker.take(PYTHON, 0x20 if one == "other" else 0x31, 41, layers="rmw rcl")
        if one != "take":
            asker.publish(PYTHON, 0x12, 2, layers="rcl rmw")
    assert analyse(asker).rows(MARKED)[6] == (1, 31, count)


def test_who_executes_goals_may_publish_for_these(asker: RosSystem, analyse: Analyse) -> None:
    """As soon as it took the first one."""
    asker.service(PYTHON, 0x41, "/move/_action/send_goal", callback=None)
    for wait in (1_000, 9_000):
        asker.wait(wait)
        asker.take(PYTHON, 0x31, wait, layers="rmw rcl")
        asker.publish(PYTHON, 0x12, 1, layers="rcl rmw")
        asker.take_request(PYTHON, 0x41, wait, gid=7)
    asker.publish(PYTHON, 0x12, 2, layers="rcl rmw")
    assert analyse(asker).rows(MARKED)[6:] == [(1, 1_000, 1), (1, 9_000, 2)]
