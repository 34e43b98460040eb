"""Nodes, and which of them an object belongs to."""

from __future__ import annotations

from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread

MAIN = Thread(100)
PUBLISHERS = (
    "SELECT p.topic_name, n.full_name FROM publisher AS p LEFT JOIN node AS n USING (node_id) "
    "ORDER BY p.publisher_id"
)


def test_full_names(system: RosSystem, analyse: Analyse) -> None:
    expected = []
    for handle, (namespace, full_name) in enumerate(
        [("/", "/talker"), ("/robot", "/robot/talker"), ("", "/talker")], start=1
    ):
        created = system.node(MAIN, handle, "talker", namespace)
        expected.append(("talker", namespace, full_name, handle, created, False))
    assert (
        analyse(system).rows(
            "SELECT name, namespace, full_name, node_handle, created_ns, is_inferred FROM node "
            "ORDER BY node_id"
        )
        == expected
    )


def names(system: RosSystem, analyse: Analyse) -> list[str]:
    found: list[str] = analyse(system).column("SELECT full_name FROM node ORDER BY node_id")
    return found


def test_equal_names_at_one_time_go_with_host_or_process(
    system: RosSystem, analyse: Analyse
) -> None:
    """Two robots, two domains, or both; where one is there after the other, the name is enough."""
    system.add_source(0, "alpha", "boot-a")
    system.add_source(1, "beta", "boot-b")
    one, two, other = Thread(100), Thread(200), Thread(100, trace=1)
    system.node(Thread(300), 0x1, "again")
    system.node(Thread(400), 0x1, "again")
    for handle, name in enumerate(("lidar", "planner", "base", "camera"), start=1):
        system.node(one, handle, name)
    for handle, name in enumerate(("planner", "base"), start=1):
        system.node(two, handle, name)
    for handle, name in enumerate(("lidar", "base"), start=1):
        system.node(other, handle, name)
    system.context(one)
    system.context(two)
    assert names(system, analyse) == [
        "/again",
        "/again",
        "/lidar@alpha",
        "/planner@100",
        "/base@alpha 100",
        "/camera",
        "/planner@200",
        "/base@alpha 200",
        "/lidar@beta",
        "/base@beta",
    ]


def test_equal_names_in_containers_that_share_host_and_process_id(
    system: RosSystem, analyse: Analyse
) -> None:
    for namespace in (1, 2, 1):
        system.node(Thread(7, pid_ns=namespace), namespace, "lidar")
    found = names(system, analyse)
    assert found == ["/lidar@7 #1", "/lidar@7 #2", "/lidar@7 #1"]


def test_rosout_may_be_created_inside_its_node(system: RosSystem, analyse: Analyse) -> None:
    """Foxy to Iron: the node's own event comes after it."""
    system.publisher(MAIN, 0x10, "/rosout", node=0x1)
    system.node(MAIN, 0x1, "first")
    system.publisher(MAIN, 0x11, "/a", node=0x1)
    system.publisher(MAIN, 0x12, "/rosout", node=0x2)
    system.node(MAIN, 0x2, "second")
    assert analyse(system).rows(PUBLISHERS) == [
        ("/rosout", "/first"),
        ("/a", "/first"),
        ("/rosout", "/second"),
    ]


def test_a_handle_used_again_with_rosout_inside_its_node(
    system: RosSystem, analyse: Analyse
) -> None:
    for name in ("first", "second"):
        system.publisher(MAIN, 0x10, "/rosout", node=0x1)
        system.node(MAIN, 0x1, name)
        system.publisher(MAIN, 0x11, f"/{name}", node=0x1)
    assert analyse(system).rows(PUBLISHERS) == [
        ("/rosout", "/first"),
        ("/first", "/first"),
        ("/rosout", "/second"),
        ("/second", "/second"),
    ]


def test_a_handle_used_again_with_rosout_after_its_node(
    system: RosSystem, analyse: Analyse
) -> None:
    """Since Jazzy: what the old node created last is directly followed by the new node."""
    for name in ("first", "second"):
        system.node(MAIN, 0x1, name)
        system.publisher(MAIN, 0x10, "/rosout", node=0x1)
        system.publisher(MAIN, 0x11, f"/{name}", node=0x1)
    assert analyse(system).rows(PUBLISHERS) == [
        ("/rosout", "/first"),
        ("/first", "/first"),
        ("/rosout", "/second"),
        ("/second", "/second"),
    ]


def test_nodes_created_on_two_threads_at_once(system: RosSystem, analyse: Analyse) -> None:
    other = Thread(100, 101)
    system.publisher(MAIN, 0x10, "/rosout", node=0x1)
    system.publisher(other, 0x12, "/rosout", node=0x2)
    system.node(other, 0x2, "second")
    system.node(MAIN, 0x1, "first")
    assert analyse(system).rows(PUBLISHERS) == [("/rosout", "/first"), ("/rosout", "/second")]


def test_a_handle_never_initialised_is_one_placeholder(system: RosSystem, analyse: Analyse) -> None:
    system.publisher(MAIN, 0x10, "/a", node=0x7)
    system.subscription(MAIN, 0x11, "/b", node=0x7)
    system.publisher(Thread(200), 0x10, "/c", node=0x7)
    model = analyse(system)
    assert model.rows(
        "SELECT pid, node_handle, full_name, is_inferred, created_ns FROM node "
        "JOIN process USING (process_id) ORDER BY pid"
    ) == [(100, 0x7, None, True, None), (200, 0x7, None, True, None)]
    assert model.rows(
        "SELECT count(DISTINCT node_id) FROM (SELECT node_id FROM publisher "
        "UNION ALL SELECT node_id FROM subscription)"
    ) == [(2,)]


def test_objects_name_nodes_of_their_process_only(system: RosSystem, analyse: Analyse) -> None:
    for pid, name in ((100, "mine"), (200, "yours")):
        system.node(Thread(pid), 0x1, name)
        system.publisher(Thread(pid), 0x10, "/a", node=0x1)
    assert analyse(system).rows(PUBLISHERS) == [("/a", "/mine"), ("/a", "/yours")]


def test_a_timer_is_linked_to_its_node(system: RosSystem, analyse: Analyse) -> None:
    """The link comes last; Foxy has none, and an address can be used again."""
    system.node(MAIN, 0x1, "talker")
    system.timer(MAIN, 0x20, 0xC1, period=5_000_000)
    system.timer(MAIN, 0x20, 0xC2, period=7_000_000, node=None)
    model = analyse(system)
    assert model.rows(
        "SELECT period_ns, full_name FROM timer LEFT JOIN node USING (node_id) ORDER BY timer_id"
    ) == [(5_000_000, "/talker"), (7_000_000, None)]
    assert model.rows("SELECT label, node FROM callback_label ORDER BY callback_id") == [
        ("Timer(5 ms)", "/talker"),
        ("Timer(7 ms)", "[main 100]"),
    ]


def test_services_and_clients(system: RosSystem, analyse: Analyse) -> None:
    system.node(MAIN, 0x1, "server")
    names = ("/server/get_parameters", "/get_parameters_now", "/server/change_state", "/add")
    for number, name in enumerate(names):
        system.add(
            "ros2:rcl_service_init",
            MAIN,
            service_handle=0x30 + number,
            node_handle=0x1,
            rmw_service_handle=0x40,
            service_name=name,
        )
    system.add("ros2:rmw_client_init", MAIN, rmw_client_handle=0x60, gid=[7] * 16)
    system.add(
        "ros2:rcl_client_init",
        MAIN,
        client_handle=0x50,
        node_handle=0x1,
        rmw_client_handle=0x60,
        service_name="/add",
    )
    model = analyse(system)
    assert model.column("SELECT service_name FROM service WHERE is_internal ORDER BY 1") == [
        "/server/change_state",
        "/server/get_parameters",
    ]
    assert model.rows(
        "SELECT service_name, full_name, client_handle, gid, is_internal FROM client "
        "JOIN node USING (node_id)"
    ) == [("/add", "/server", 0x50, bytes([7] * 16), False)]


def test_lifecycle_transitions(system: RosSystem, analyse: Analyse) -> None:
    times = []
    for name in ("first", "second"):
        system.node(MAIN, 0x1, name)
        system.add(
            "ros2:rcl_lifecycle_state_machine_init", MAIN, node_handle=0x1, state_machine=0x5
        )
        times.append(
            system.add(
                "ros2:rcl_lifecycle_transition",
                MAIN,
                state_machine=0x5,
                start_label="unconfigured",
                goal_label="configuring",
            )
        )
    assert analyse(system).rows(
        "SELECT at_ns, full_name, start_state, goal_state FROM lifecycle_transition "
        "JOIN node USING (node_id) ORDER BY at_ns"
    ) == [
        (times[0], "/first", "unconfigured", "configuring"),
        (times[1], "/second", "unconfigured", "configuring"),
    ]


def test_each_state_machine_has_a_node_of_its_own(system: RosSystem, analyse: Analyse) -> None:
    """Another process has one at the same address, and one that began before the trace."""
    other = Thread(200)
    for thread, node, name, machine in (
        (MAIN, 0x1, "first", 0x5),
        (MAIN, 0x2, "second", 0x6),
        (other, 0x1, "third", 0x5),
    ):
        system.node(thread, node, name)
        system.add(
            "ros2:rcl_lifecycle_state_machine_init", thread, node_handle=node, state_machine=machine
        )
    for thread, machine, goal in (
        (other, 0x6, "a"),
        (MAIN, 0x6, "b"),
        (MAIN, 0x5, "c"),
        (other, 0x5, "d"),
    ):
        system.add(
            "ros2:rcl_lifecycle_transition",
            thread,
            state_machine=machine,
            start_label="inactive",
            goal_label=goal,
        )
    assert analyse(system).rows(
        "SELECT goal_state, full_name FROM lifecycle_transition LEFT JOIN node USING (node_id) "
        "ORDER BY goal_state"
    ) == [("a", None), ("b", "/second"), ("c", "/first"), ("d", "/third")]
