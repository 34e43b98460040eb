"""The picture of a flow: tree, JSON, what is said about it. Its rows have golden cases."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import duckdb
import pytest
from support.golden import fill_case, insert

from msgflow import Database, UsageError
from msgflow.export.flow import tree_text

CASES = Path(__file__).resolve().parents[1] / "schema" / "cases" / "main.flow_step"


def database_of(case: str, empty_database: Path, directory: Path) -> Database:
    path = directory / "case.duckdb"
    shutil.copyfile(empty_database, path)
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, CASES / f"{case}.case")
    return Database(path)


@pytest.fixture(scope="module")
def robot(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    """A camera whose images two nodes work on; the tracker joins both ways again."""
    with database_of(
        "forward_with_internal", empty_database, tmp_path_factory.mktemp("robot")
    ) as database:
        yield database


def test_a_chain_goes_straight_down_and_what_was_asked_for_is_marked(robot: Database) -> None:
    assert str(robot.flow("/detections")).splitlines() == [
        "publication 2, /detections; times count from 1970-01-01T00:00:00.000000100Z",
        "  +0 ns  /camera  Timer(100 ms)  ran 90 ns  thread thread 1  Camera::tick",
        " +10 ns  publishes /image  in 10 ns or more",
        "+120 ns  /detector  Subscription(/image)  publish to take 80 ns  take to callback 20 ns"
        "  ran 60 ns  thread thread 1  Detector::on_image",
        "+150 ns  publishes /detections  in 10 ns or more  ◀",
        "+220 ns  /tracker  Subscription(/detections)"
        "  publish to take 40 ns (events were lost here)  take to callback 20 ns"
        "  ran NA: never seen to end  thread thread 1  Tracker::on_detections",
        "+250 ns  publishes /tracks  in 10 ns or more",
        "├──      NA  /recorder  Subscription(/tracks)  lost: lost_in_transport",
        "└──      NA  /camera  Subscription(/tracks)  not connected: before_subscription",
    ]


@pytest.mark.thorough
def test_a_publication_may_take_until_its_thread_goes_on(
    empty_database: Path, tmp_path: Path
) -> None:
    """The message is written behind its last event; behind a gap, the next one is not known."""
    steps = "../internal.flow_steps/message"
    path = tmp_path / "pages.duckdb"
    shutil.copyfile(empty_database, path)
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, CASES / f"{steps}.case")
    with Database(path) as database:
        tree = str(database.flow(publication_id=1))
        assert "publishes /image  in 10 ns to 100 ns" in tree
    with duckdb.connect(str(path)) as connection:
        connection.execute(
            "INSERT INTO store.thread_break BY NAME SELECT thread_id, end_event_id + 1 AS "
            "resumed_event_id, end_ns + 1 AS resumed_ns, false AS is_elsewhere, run_id "
            "FROM store.publication WHERE publication_id = 1"
        )
    with Database(path) as database:
        assert "publishes /image  in 10 ns or more" in str(database.flow(publication_id=1))


@pytest.mark.thorough
def test_a_flow_that_ends_at_a_node_which_publishes_says_so(
    empty_database: Path, tmp_path: Path
) -> None:
    with database_of("../main.dead_end/kept_messages", empty_database, tmp_path) as database:
        flow = database.flow("/boxes")
        *_, last = str(flow).splitlines()
        text = "ends here; /fusion publishes /objects from /clusters: msgflow suggest links"
        assert last.strip() == text
        assert [node["otherwise_published"] for node in flow.nodes.values()][-1] == (
            "/objects from /clusters"
        )
        assert f"\x1b[2m{text}" in tree_text(flow, color=True)
        # What comes back to the node ends a loop, and a sink publishes nothing.
        assert "ends here" not in str(database.flow("/plan"))
        assert "ends here" not in str(database.flow("/tracks"))


@pytest.mark.thorough
def test_what_a_busy_executor_added_is_said(empty_database: Path, tmp_path: Path) -> None:
    """The numbers are worked out by hand in the golden cases of waits."""
    path = tmp_path / "busy.duckdb"
    shutil.copyfile(empty_database, path)
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, CASES.parents[2] / "query/cases/path-breakdown/busy_executor.case")
    with Database(path) as database:
        lines = {}
        for topic in ("/a", "/b", "/c"):
            flow = database.flow(topic)
            lines[topic] = str(flow).splitlines()[-1].split("  ran ")[0].split(f"({topic})  ")[1]
            bounds = [
                (node["busy_min_ns"], node["busy_max_ns"])
                for node in flow.to_dict()["nodes"]
                if node["kind"] == "callback_instance"
            ]
            if topic == "/c":
                assert bounds == [(9_700_000, 29_600_000)]
    assert lines == {
        "/a": "publish to take 14.150 ms  take to callback 50.000 µs",
        "/b": "publish to take 35.250 ms  in the queue up to 29.700 ms  take to callback 50.000 µs",
        "/c": "publish to take 30.350 ms  in the queue 9.700 ms to 29.600 ms"
        "  take to callback 50.000 µs",
    }


@pytest.mark.thorough
@pytest.mark.parametrize("reason", ["receiver_gap", "unknown"])
def test_what_may_have_been_taken_is_not_called_untaken(
    reason: str, empty_database: Path, tmp_path: Path
) -> None:
    database = database_of("forward_with_internal", empty_database, tmp_path)
    with duckdb.connect(str(database.path)) as connection:
        connection.execute(
            f"UPDATE store.undelivered SET reason = '{reason}' WHERE reason = 'lost_in_transport'"
        )
    with database:
        tree = str(database.flow("/detections"))
    status = "unknown" if reason == "unknown" else f"unknown: {reason}"
    assert f"/recorder  Subscription(/tracks)  {status}\n" in tree
    assert "/camera  Subscription(/tracks)  not connected: before_subscription" in tree


def test_the_copy_of_a_message_within_the_process_is_called_so(
    empty_database: Path, tmp_path: Path
) -> None:
    with database_of("copy_within_the_process", empty_database, tmp_path) as database:
        tree = str(database.flow(publication_id=1, direction="forward"))
    assert tree.count("copy of a message within the process") == 1
    assert "NA: no callback was seen" not in tree


def test_branches_are_indented_and_nothing_is_drawn_twice(robot: Database) -> None:
    assert str(robot.flow("/image", direction="forward")).splitlines() == [
        "publication 1, /image; times count from 1970-01-01T00:00:00.000000110Z",
        "  +0 ns  /camera  publishes /image  in 10 ns or more  thread thread 1",
        "├──  +95 ns  /recorder  Subscription(/image)  publish to take 85 ns"
        "  NA: no callback was seen  thread thread 1",
        "├── +110 ns  /detector  Subscription(/image)  publish to take 80 ns"
        "  take to callback 20 ns  ran 60 ns  thread thread 1  Detector::on_image",
        "│   +140 ns  publishes /detections  in 10 ns or more",
        "│   +210 ns  /tracker  Subscription(/detections)"
        "  publish to take 40 ns (events were lost here)  take to callback 20 ns"
        "  ran NA: never seen to end  thread thread 1  Tracker::on_detections",
        "│   +240 ns  [1] publishes /tracks  in 10 ns or more",
        "│   ├──      NA  /recorder  Subscription(/tracks)  lost: lost_in_transport",
        "│   └──      NA  /camera  Subscription(/tracks)  not connected: before_subscription",
        "└── +120 ns  /tracker  Subscription(/image)  publish to take 90 ns (one of 2 candidates)"
        "  take to callback 20 ns  ran 10 ns  thread thread 1  Tracker::on_image",
        "    +240 ns  see [1]  publishes /tracks",
    ]


@pytest.mark.thorough
def test_what_follows_from_a_request_without_a_callback_names_its_node(
    empty_database: Path, tmp_path: Path
) -> None:
    with database_of("services_forward", empty_database, tmp_path) as database:
        path = database.path
    with duckdb.connect(str(path)) as connection:
        connection.execute(
            "INSERT INTO store.publication BY NAME SELECT * REPLACE "
            "(90 AS publication_id, 665 AS start_ns, 666 AS end_ns, NULL AS callback_event_id) "
            "FROM store.publication ORDER BY publication_id DESC LIMIT 1"
        )
        connection.execute(
            "INSERT INTO store.link_call BY NAME SELECT run_id, 2 AS taken_request_id, "
            "publication_id, publisher_id, 1 AS candidate_count "
            "FROM store.publication WHERE publication_id = 90"
        )
    with Database(path) as database:
        lines = str(database.flow(publication_id=90)).splitlines()
    assert lines[2] == " +10 ns  requests /add  sending to take 80 ns"
    assert lines[3].startswith("+165 ns  /ticker  publishes /tick  take_adjacent 75 ns")
    assert lines[3].endswith("  thread thread 1  ◀")


def test_a_callback_that_waits_for_a_service_names_it(empty_database: Path, tmp_path: Path) -> None:
    with database_of("../internal.flow_steps/message", empty_database, tmp_path) as database:
        lines = str(database.flow(publication_id=1, direction="forward")).splitlines()
    (line,) = [line for line in lines if "Filter::image" in line]
    assert "  ran 200 ns  service /add (/server) 85 ns: queue 40 ns, callback 30 ns  " in line


@pytest.mark.thorough
def test_calls_of_services(empty_database: Path, tmp_path: Path) -> None:
    with database_of("services_forward", empty_database, tmp_path) as database:
        flow = database.flow(callback_instance_id=5)
        answered = str(database.flow(response_id=1, direction="backward")).splitlines()
        unknown = str(database.flow(request_id=3, direction="forward")).splitlines()
    thread = "  thread thread 1"
    assert str(flow).splitlines() == [
        "callback_instance 5, Timer(2 ms); times count from 1970-01-01T00:00:00.000000500Z",
        f"  +0 ns  /caller  Timer(2 ms)  ran 30 ns{thread}  call  ◀",
        "├──  +10 ns  requests /add  sending to take 80 ns",
        f"│   +100 ns  /server  Service(/add)  take to callback 10 ns  ran 50 ns{thread}  add",
        "│   ├── +120 ns  publishes /result  in 5 ns or more",
        "│   │   +200 ns  /sink  Subscription(/result)  publish to take 65 ns"
        "  take to callback 10 ns  ran 20 ns"
        f"{thread}  on_result",
        f"│   └── +152 ns  /caller  Client(/add)  service 2 ns  NA: it was not taken{thread}",
        "├──  +20 ns  requests /sub  sending to take 40 ns  NA: no callback was seen",
        f"│    +70 ns  /caller  Client(/sub)  service 10 ns  sending to take 10 ns{thread}",
        "└──  +26 ns  requests /sub  sending to take 40 ns  NA: no callback was seen",
    ]
    assert flow.notes == [
        "1 message on topics and services of ROS itself left out; --internal shows them"
    ]
    assert answered[1:5] == [
        f"  +0 ns  /caller  Client(/add)  service 2 ns  sending to take 18 ns{thread}",
        f" -52 ns  /server  Service(/add)  take to callback 10 ns  ran 50 ns{thread}  add",
        "-142 ns  requests /add  sending to take 80 ns",
        "-152 ns  /caller  Subscription(/tick)  publish to take 78 ns  take to callback 10 ns"
        "  ran 30 ns"
        f"{thread}  on_tick",
    ]
    assert unknown[1] == (f"  +0 ns  ?  requests /add  NA: its sending was not seen{thread}")


def test_backward_ends_at_one_cause_twice(robot: Database) -> None:
    lines = str(robot.flow("/tracks", direction="backward")).splitlines()
    assert [line.split(" ns")[0].strip() + " ns" for line in lines[1:]] == [
        "+0 ns",
        "├── -120 ns",
        "│   -240 ns",
        "│   -250 ns",
        "└──  -30 ns",
        "-100 ns",
        "-130 ns",
        "-240 ns",
    ]
    assert lines[2].count("partial_sync 110 ns") == 1
    assert lines[3].endswith("[1] publishes /image  in 10 ns or more")
    assert lines[-1].endswith("see [1]  publishes /image")


@pytest.mark.thorough
def test_a_ring_is_drawn_once(empty_database: Path, tmp_path: Path) -> None:
    with database_of("ring", empty_database, tmp_path) as database:
        for direction in ("forward", "backward", "both"):
            lines = str(database.flow(publication_id=1, direction=direction)).splitlines()
            assert len(lines) == 4
            assert "[1] " in lines[1]
            assert "see [1]" in lines[3]


def test_what_the_trace_does_not_show_is_said(empty_database: Path, tmp_path: Path) -> None:
    with database_of("take_without_publication", empty_database, tmp_path) as database:
        line = str(database.flow(take_id=6)).splitlines()[1]
    assert "NA: its publication was not seen, publisher_trace_ends" in line
    with database_of("callback_without_message", empty_database, tmp_path) as database:
        line = str(database.flow(callback_instance_id=5)).splitlines()[1]
    assert "NA: its message was not seen" in line


def test_points_in_time_and_widths(robot: Database) -> None:
    flow = robot.flow("/image")
    absolute = tree_text(flow, is_absolute=True).splitlines()
    assert absolute[0] == "publication 1, /image"
    assert absolute[1].startswith("1970-01-01T00:00:00.000000100Z  /camera  Timer")
    for width in (20, 80, 120):
        lines = tree_text(flow, width=width).splitlines()
        assert max(map(len, lines)) <= max(width, 56)
    whole = re.findall(r"  (publish to take [\d.]+ .?s|ran [\d.]+ .?s)", tree_text(flow))
    assert len(whole) > 3
    for width in range(72, 120):
        narrow = tree_text(flow, width=width)
        assert all(detail in narrow for detail in whole), width
    assert "\ue000" not in narrow
    assert "\x1b[" not in tree_text(flow)
    assert "\x1b[" in tree_text(flow, color=True)


@pytest.mark.thorough
def test_limits_are_said(robot: Database) -> None:
    flow = robot.flow("/image", direction="forward", depth=1)
    assert flow.is_cut
    assert flow.notes == [
        "1 message on topics and services of ROS itself left out; --internal shows them",
        "the flow goes on at 1 place beyond --depth 1",
    ]
    cut = robot.flow("/image", direction="forward", limit=3)
    assert "the flow goes on at 3 places beyond --limit 3" in cut.notes
    assert str(cut).count("… 1 more") == 3
    assert not robot.flow("/image").is_cut


def test_json_has_each_node_once_and_all_edges(robot: Database) -> None:
    flow = robot.flow("/image")
    content = json.loads(flow.to_json())
    assert content == flow.to_dict()
    assert list(content) == ["run_id", "run", "start", "direction", "is_cut", "nodes", "edges"]
    assert content["start"] == {"kind": "publication", "id": 1}
    keys = [(node["kind"], node["id"]) for node in content["nodes"]]
    assert len(keys) == len(set(keys)) == 13
    ends = {(edge["from_kind"], edge["from_id"]) for edge in content["edges"]}
    ends |= {(edge["to_kind"], edge["to_id"]) for edge in content["edges"]}
    assert ends == set(keys)
    fates = {
        (edge["to_id"], edge["link_kind"], edge["reason"])
        for edge in content["edges"]
        if edge["to_kind"] == "subscription"
    }
    assert fates == {
        (4, "lost", "lost_in_transport"),
        (6, "not_connected", "before_subscription"),
    }


@pytest.mark.thorough
def test_the_message_is_the_first_at_or_after_a_time(small_database: Path) -> None:
    with Database(small_database) as database:
        assert database.flow("/chatter").start.id == 2
        assert database.flow("/chatter", run="morning").start.id == 1
        for at in (None, "0.5s", "500ms", 1_700_000_010_500_000_000, "2023-11-14T22:13:30.5Z"):
            assert database.flow("/chatter", at=at).start.id == 2
        # A whole number is epoch ns, which who wrote it may not have meant; as text it is seconds.
        early = database.flow("/chatter", at=2)
        assert (early.start.id, len(early.notes)) == (2, 1)
        assert "before the run" in early.notes[0]
        with pytest.raises(UsageError) as raised:
            database.flow("/chatter", at="0.500000001s")
        assert raised.value.hint is not None
        assert "--at +0.500000000 " in raised.value.hint
        assert database.flow("/chatter", at="+0.500000000").start.id == 2


def test_what_cannot_be_started_from_is_named(small_database: Path) -> None:
    with Database(small_database) as database:
        for given, message in (
            ({"place": "/chater"}, "no such topic or node"),
            ({}, "starts from one thing"),
            ({"place": "/chatter", "take_id": 1}, "starts from one thing"),
            ({"publication_id": 7}, "no such publication — 7"),
            ({"publication_id": 1, "at": "1s"}, "an identity has a time"),
            ({"place": "/chatter", "run": "all"}, "a message is of one run"),
            ({"place": "/chatter", "at": "noon"}, "cannot read the time of --at"),
            ({"place": "/chatter", "direction": "up"}, "--direction has no such value"),
            ({"place": "/chatter", "depth": -1}, "depth"),
            ({"place": "/chatter", "limit": 0}, "limit"),
        ):
            with pytest.raises(UsageError, match=message):
                database.flow(**given)  # type: ignore[arg-type]


def test_a_topic_without_publications_says_so(small_database: Path) -> None:
    with duckdb.connect(str(small_database)) as connection:
        names = ["subscription_id", "run_id", "topic_name"]
        insert(connection, "subscription", names, [["1", "2", "/unused"]])
    with (
        Database(small_database) as database,
        pytest.raises(UsageError, match="no message that was published there"),
    ):
        database.flow("/unused")


@pytest.mark.thorough
def test_a_long_chain_is_read_as_far_as_the_limits_say(
    empty_database: Path, tmp_path: Path
) -> None:
    """A ping-pong of many messages: every message is caused by the one before."""
    path = tmp_path / "pingpong.duckdb"
    shutil.copyfile(empty_database, path)
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, CASES / "ring.case")
        for table in ("publication", "take", "callback_instance", "link_transport", "link_causal"):
            connection.execute(f"DELETE FROM store.{table}")
        connection.execute(CHAIN)
    with Database(path) as database:
        flow = database.flow(publication_id=10_000)
        assert {abs(node["depth"]) for node in flow.nodes.values()} == set(range(97))
        assert len(str(flow).splitlines()) == 2 * 64 + 2
        assert flow.notes == ["the flow goes on at 2 places beyond --depth 32"]
        everything = database.flow(publication_id=10_000, depth=1_000_000, limit=1_000)
        assert len(everything.nodes) == 1_000
        assert everything.notes == ["the flow goes on at 2 places beyond --limit 1000"]


CHAIN = """
INSERT INTO store.publication BY NAME
    SELECT n AS publication_id, 1 AS run_id, 1 AS trace_id, 1 AS process_id, 1 AS thread_id,
        10 * n AS start_ns, 10 * n + 1 AS end_ns
    FROM range(1, 20001) AS r (n);
INSERT INTO store.take BY NAME
    SELECT n AS take_id, 1 AS run_id, 1 AS trace_id, 1 AS process_id, 1 AS thread_id,
        10 * n + 2 AS taken_ns, 'rmw' AS "method"
    FROM range(1, 20001) AS r (n);
INSERT INTO store.callback_instance BY NAME
    SELECT n AS callback_instance_id, 1 AS run_id, 1 AS trace_id, 1 AS callback_id,
        1 AS process_id, 1 AS thread_id, 10 * n + 3 AS start_ns, 10 * n + 12 AS end_ns,
        n AS take_id, false AS is_intra_process, 1 AS depth
    FROM range(1, 20001) AS r (n);
INSERT INTO store.link_transport BY NAME
    SELECT 1 AS run_id, n AS publication_id, n AS take_id, 'exact' AS "method",
        false AS is_self_loop, false AS is_loss_affected
    FROM range(1, 20001) AS r (n);
INSERT INTO store.link_causal BY NAME
    SELECT 1 AS run_id, n AS callback_instance_id, n + 1 AS publication_id, 'direct' AS kind,
        false AS is_loss_affected
    FROM range(1, 20000) AS r (n);
"""


@pytest.mark.thorough
def test_a_stored_message_waits_from_when_its_subscription_existed(
    empty_database: Path, tmp_path: Path
) -> None:
    stored = "../../../query/cases/path-breakdown/stored_messages"
    with database_of(stored, empty_database, tmp_path) as database:
        (part,) = database.sql(
            "SELECT duration_ns FROM end_to_end_part([1], sink_take_id := 21) WHERE part = 'stored'"
        ).table.to_pylist()
        flow = database.flow("/map")
        (edge,) = [edge for edge in flow.edges if edge["stored_ns"]]
    assert edge["stored_ns"] == part["duration_ns"] == 10_003_900
    rest = edge["wait_ns"] - 10_003_900
    assert f"stored 10.004 ms, then publish to take {rest} ns" in str(flow)
