"""Indirect links declared after the fact: what they do to a database, and when they refuse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.analysis import Analysis
from support.each import each
from support.ingested import contents, ingest_one, rows
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import few

from msgflow import Database
from msgflow.errors import UsageError
from msgflow_sim import scenarios, simulate

BOTH = """
links:
  - kind: periodic_async
    node: /fusion
    inputs: [/a, /b]
    outputs: [/c, /d]
"""
KINDS = "SELECT kind, count(*) FROM link_causal GROUP BY kind ORDER BY kind"
DECLARED = (
    "SELECT a.kind, a.source, list(DISTINCT s.topic_name ORDER BY s.topic_name), "
    "list(DISTINCT p.topic_name ORDER BY p.topic_name) FROM annotation AS a "
    "JOIN annotation_input AS i USING (annotation_id) JOIN subscription AS s USING "
    "(subscription_id) JOIN annotation_output AS o USING (annotation_id) "
    "JOIN publisher AS p USING (publisher_id) GROUP BY a.annotation_id, a.kind, a.source "
    "ORDER BY a.annotation_id"
)


Contents = dict[str, list[tuple[Any, ...]]]


@pytest.fixture
def untouched(database: Path) -> Contents:
    """What is in the database before the test."""
    return contents(database)


def write(path: Path, text: str) -> Path:
    file = path.parent / "links.yaml"
    file.write_text(text)
    return file


@pytest.mark.thorough
def test_links_are_derived_anew(database: Path) -> None:
    assert rows(database, KINDS) == [("direct", 4)]
    with Database(database) as opened:
        (applied,) = opened.apply_links(write(database, BOTH))
        assert (applied.annotation_count, applied.known_count, applied.link_count) == (1, 0, 8)
        assert opened.check() == []
    assert rows(database, KINDS) == [("direct", 4), ("periodic_async", 8)]
    assert rows(database, DECLARED) == [("periodic_async", "file", ["/a", "/b"], ["/c", "/d"])]


@pytest.mark.thorough
def test_another_file_replaces_the_former(database: Path) -> None:
    with Database(database) as opened:
        opened.apply_links(write(database, BOTH))
        before = contents(database)
        opened.apply_links(write(database, BOTH))
        after = contents(database)
        assert before["link_causal"] != []
        assert len(before["link_causal"]) == len(after["link_causal"])
        opened.apply_links(write(database, BOTH.replace("[/a, /b]", "/b")))
        assert rows(database, DECLARED) == [("periodic_async", "file", ["/b"], ["/c", "/d"])]
        opened.apply_links(write(database, "links: []"))
    assert rows(database, "SELECT count(*) FROM annotation_input") == [(0,)]
    assert rows(database, KINDS) == [("direct", 4)]


@pytest.mark.thorough
def test_patterns(database: Path) -> None:
    """Of nodes and topics; ROS's own topics are none of them, and nodes without are left out.

    Whether a name means several nodes is asked only of those that have the topics.
    """
    text = BOTH.replace("/fusion", "'/*u*'").replace("[/a, /b]", "'*'").replace("[/c, /d]", "/[cd]")
    for written in (text, BOTH.replace("/fusion", "'*'")):
        with Database(database) as opened:
            opened.apply_links(write(database, written))
        assert rows(database, DECLARED) == [("periodic_async", "file", ["/a", "/b"], ["/c", "/d"])]


@pytest.mark.thorough
def test_equal_entries_are_one(database: Path) -> None:
    entry = BOTH.partition("links:\n")[2]
    other = entry.replace("[/a, /b]", "[/b, /a, '/[ab]']")
    with Database(database) as opened:
        (applied,) = opened.apply_links(write(database, f"links:\n{entry}{other}"))
    assert applied.annotation_count == 1
    assert len(rows(database, DECLARED)) == 1


PLACES = ("process: right", "process: 400", "process: '400'\n    host: alpha")


@pytest.mark.parametrize("place", few(PLACES, PLACES[-1]))
def test_a_name_that_occurs_twice_with_its_process(database: Path, place: str) -> None:
    text = BOTH.replace("/fusion", "/ns/twin").replace("[/a, /b]", "/x").replace("[/c, /d]", "/y")
    with Database(database) as opened:
        opened.apply_links(write(database, f"{text}    {place}\n"))
    assert rows(database, "SELECT p.name FROM annotation JOIN process AS p USING (process_id)") == [
        ("right",)
    ]


WRONG = (
    ("/fusion", "/fusio", 4, "no such node — /fusio", "did you mean /fusion"),
    ("/fusion", "'/zz*'", 4, "no such node — /zz*", "/fusion, /ns/twin, /relay"),
    ("/fusion", "/ns/twin", 4, "2 nodes have this name — /ns/twin", "process right 400"),
    ("/b]", "/bb]", 5, "/fusion does not subscribe to such a topic — /bb", "/a, /b"),
    ("/d]", "'/z*']", 6, "/fusion does not publish on such a topic — /z*", "/c, /d"),
    (
        "/fusion\n    inputs: [/a, /b]\n    outputs: [/c, /d]",
        "'/n*'\n    inputs: /x\n    outputs: /y",
        4,
        "2 nodes have this name — /ns/twin",
        "process right 400",
    ),
    (
        "/fusion\n    inputs: [/a, /b]",
        "'/[fr]*'\n    inputs:\n      - /a\n      - '/z[a-c]'",
        7,
        "no node that matches /[fr]* subscribes to such a topic — /z[a-c]",
        "the topics are /a, /b, /c",
    ),
    ("periodic_async", "periodic", 3, "no such kind of link — periodic", "partial_sync"),
    ("/fusion", "/fusion\n    host: beta", 5, "no such node on this host — beta", "alpha"),
    ("/fusion", "/fusion\n    process: 7", 5, "in this process — 7", "fusion 100"),
)


@pytest.mark.thorough
@each(WRONG)
def test_what_does_not_exist_changes_nothing(
    wrong: tuple[str, str, int, str, str], database: Path, untouched: Contents
) -> None:
    old, new, line, message, hint = wrong
    with Database(database) as opened, pytest.raises(UsageError) as caught:
        opened.apply_links(write(database, BOTH.replace(old, new, 1)))
    assert message in caught.value.message
    assert f"links.yaml, line {line}: " in caught.value.message
    assert caught.value.hint is not None
    assert hint in caught.value.hint
    assert contents(database) == untouched


@pytest.mark.thorough
def test_contradictory_entries_are_named(database: Path) -> None:
    """Both are in force; the finding goes with the file."""
    found = "SELECT count, detail FROM finding WHERE name = 'contradictory_annotations'"
    entry = BOTH.partition("links:\n")[2]
    other = entry.replace("periodic_async", "partial_sync").replace("[/c, /d]", "/d")
    with Database(database) as opened:
        opened.apply_links(write(database, f"links:\n{entry}{other}"))
    ((count, detail),) = rows(database, found)
    assert count == 2
    both = "(periodic_async and partial_sync)"
    assert detail.endswith(f"declared in two ways: /a → /d {both}, /b → /d {both}")
    with Database(database) as opened:
        opened.apply_links(write(database, BOTH))
    assert rows(database, found) == []


def test_a_partial_sync_of_one_input_changes_nothing(database: Path, untouched: Contents) -> None:
    text = BOTH.replace("periodic_async", "partial_sync").replace("[/a, /b]", "[/b]")
    with Database(database) as opened, pytest.raises(UsageError) as caught:
        opened.apply_links(write(database, text))
    assert "links.yaml, line 3: partial_sync with one input waits" in caught.value.message
    assert "/b of /fusion" in caught.value.message
    assert contents(database) == untouched


ENTRY = "  - {{kind: periodic_async, node: {}, inputs: [{}], outputs: [{}]}}\n"


BACK: tuple[tuple[list[tuple[str, str, str]], int, str], ...] = (
    ([("/relay", "/c", "/c")], 2, "a topic is input and output of the same link — /c"),
    (
        [("/fusion", "/a", "/c"), ("/relay", "/c", "/a")],
        3,
        "the links form a cycle — /a → /c → /a",
    ),
    ([("'/[fr]*'", "'*'", "/z")], 2, "no node that matches /[fr]* publishes on such a topic"),
    ([("'/[fr]*'", "/b", "/a")], 2, "no node that matches /[fr]* has all"),
)


@pytest.mark.thorough
@each(BACK)
def test_links_that_lead_back_change_nothing(
    back: tuple[list[tuple[str, str, str]], int, str], database: Path, untouched: Contents
) -> None:
    entries, line, message = back
    text = "links:\n" + "".join(ENTRY.format(*entry) for entry in entries)
    with Database(database) as opened, pytest.raises(UsageError) as caught:
        opened.apply_links(write(database, text))
    assert f"links.yaml, line {line}: {message}" in caught.value.message
    assert contents(database) == untouched


@pytest.mark.thorough
def test_what_the_trace_declares_itself_is_not_declared_again(
    shared_traces: Path, tmp_path: Path
) -> None:
    path = tmp_path / "links.duckdb"
    file = tmp_path / "links.yaml"
    file.write_text(
        "links: [{kind: partial_sync, node: /partial_sync_n_to_m, inputs: ['*'], outputs: '*'}]"
    )
    with Database(path) as database:
        database.ingest(shared_traces / "partial_sync")
        (applied,) = database.apply_links(file)
        (none,) = database.apply_links(write(path, "links: []"))
    assert (applied.annotation_count, applied.known_count) == (1, 1)
    assert applied.link_count == none.link_count == none.annotation_count == 0
    assert [(applied.traced_link_count,)] == rows(
        path, "SELECT count(*) FROM link_causal WHERE kind = 'partial_sync'"
    )
    assert rows(path, "SELECT source, count(*) FROM annotation GROUP BY source") == [("trace", 1)]


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name", few(["partial_sync", "periodic_async_jazzy24"], "periodic_async_jazzy24")
)
def test_declared_or_traced_the_links_are_the_same(
    shared_traces: Path, real: Callable[[str], Path], tmp_path: Path, name: str
) -> None:
    """Also where they are declared by what the suggestions say.

    Where one input always publishes, they say periodic_async: the links are those of partial_sync.
    """
    links = (
        "SELECT callback_instance_id, publication_id, candidate_count FROM link_causal ORDER BY ALL"
    )
    traced = real(name)
    plain, declared = (tmp_path / f"{name}-{kind}.duckdb" for kind in ("plain", "declared"))
    file = tmp_path / f"{name}.yaml"
    with Database(plain) as database:
        database.ingest(shared_traces / name, ignore=["ros2:message_link_*"])
        file.write_text(database.suggest_links().text("msgflow links apply FILE"))
        database.close()
        assert rows(plain, links) != rows(traced, links)
        database.apply_links(file)
    with Database(declared) as database:
        database.ingest(shared_traces / name, ignore=["ros2:message_link_*"], links=file)
    assert rows(plain, links) == rows(traced, links)
    assert rows(declared, links) == rows(traced, links)


def test_an_ingest_whose_links_do_not_fit_leaves_nothing(
    shared_traces: Path, tmp_path: Path
) -> None:
    file = write(tmp_path / "x", BOTH)
    with Database(tmp_path / "links.duckdb") as database, pytest.raises(UsageError) as caught:
        database.ingest(shared_traces / "sync_1_1", links=file)
    assert "no such node — /fusion" in caught.value.message
    assert not database.path.exists()


LISTENER = """
links:
  - kind: periodic_async
    node: /rtabmap
    inputs: [/tf]
    inputs_of: {}
    outputs: [/mapGraph]
"""
KEPT = (
    "SELECT DISTINCT n.full_name, u.topic_name FROM link_causal AS l "
    "JOIN callback_instance AS i ON l.callback_instance_id = i.callback_instance_id "
    "JOIN callback AS c ON i.callback_id = c.callback_id JOIN node AS n ON c.node_id = n.node_id "
    "JOIN publication AS p ON l.publication_id = p.publication_id "
    "JOIN publisher AS u ON p.publisher_id = u.publisher_id WHERE l.kind = 'periodic_async'"
)


@pytest.fixture(scope="module")
def slam(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot that says nothing about what its transforms lead to."""
    directory = tmp_path_factory.mktemp("slam")
    scenario = scenarios()["rtabmap"]
    silent = replace(
        scenario,
        processes=tuple(
            replace(process, nodes=tuple(replace(node, links=()) for node in process.nodes))
            for process in scenario.processes
        ),
    )
    simulation = simulate(silent, directory / "trace", factor=0.1)
    path = directory / "silent.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    assert rows(path, KINDS) == [("direct", 105)]
    return path


@pytest.mark.thorough
@pytest.mark.parametrize(
    "listener",
    few(
        ["/transform_listener_impl_5566a1b0", '"/transform_listener_*"'], '"/transform_listener_*"'
    ),
)
def test_messages_that_another_node_of_the_process_keeps(slam: Path, listener: str) -> None:
    with Database(slam) as opened:
        opened.apply_links(write(slam, LISTENER.format(listener)))
    assert rows(slam, KINDS) == [("direct", 105), ("periodic_async", 15)]
    assert rows(slam, KEPT) == [("/transform_listener_impl_5566a1b0", "/mapGraph")]


@pytest.mark.thorough
@each(["/transform_listener_impl_55d01c40", "/rtabmap"])
def test_it_is_of_the_same_process(listener: str, slam: Path) -> None:
    before = contents(slam)
    with Database(slam) as opened, pytest.raises(UsageError) as caught:
        opened.apply_links(write(slam, LISTENER.format(listener)))
    wanted = f"line 6: no such node in the process of /rtabmap — {listener}"
    assert wanted in caught.value.message
    assert "/transform_listener_impl_5566a1b0" in (caught.value.hint or "")
    assert contents(slam) == before


@pytest.fixture
def answering(empty_database: Path, tmp_path: Path) -> Path:
    """A node of rclpy: after each message on /in, and late after every third, /out; and a relay."""
    system = RosSystem()
    python, relay = Thread(100, name="python3"), Thread(200, name="relay")
    for thread, name, callback in ((python, "filter", None), (relay, "relay", 0xC1)):
        system.node(thread, 0x1, name)
        system.subscription(thread, 0x11, "/in", callback=callback)
        system.publisher(thread, 0x21, "/out")
    for number in range(1, 10):
        system.take(python, 0x11, number, layers="rmw rcl")
        for _ in range(1 if number % 3 else 2):
            system.publish(python, 0x21, 100 + number, layers="rcl rmw")
            system.wait(1_000)
        system.take(relay, 0x11, number)
        system.start(relay, 0xC1)
        system.publish(relay, 0x21, 200 + number)
        system.end(relay, 0xC1)
    analysis = Analysis(empty_database, tmp_path)
    analysis.build(system)
    analysis.close()
    return tmp_path / "analysis.duckdb"


ANSWERS = "links: [{kind: direct, node: /filter, inputs: /in, outputs: /out}]"
COUNTED = "SELECT kind, candidate_count, count(*) FROM link_causal GROUP BY ALL ORDER BY kind, 2"


def test_a_file_settles_what_is_doubtful(answering: Path) -> None:
    direct, doubtful = ("direct", 1, 9), ("take_adjacent", 2, 12)
    assert rows(answering, COUNTED) == [direct, doubtful]
    with Database(answering) as opened:
        (applied,) = opened.apply_links(write(answering, ANSWERS))
        assert (applied.annotation_count, applied.link_count) == (1, 0)
        assert opened.check() == []
        assert rows(answering, COUNTED) == [direct, ("take_adjacent", 1, 12)]
        opened.apply_links(write(answering, ANSWERS.replace("direct", "independent")))
        assert rows(answering, COUNTED) == [direct]
        opened.apply_links(write(answering, "links: []"))
    assert rows(answering, COUNTED) == [direct, doubtful]


@pytest.mark.thorough
def test_a_file_forbids_what_callbacks_published(answering: Path) -> None:
    text = ANSWERS.replace("direct", "independent").replace("/filter", "/relay")
    with Database(answering) as opened:
        opened.apply_links(write(answering, text))
    assert rows(answering, COUNTED) == [("take_adjacent", 2, 12)]


@pytest.mark.thorough
def test_independent_counts_where_both_are_declared(answering: Path) -> None:
    both = ANSWERS.replace("]", f", {ANSWERS[8:-1].replace('direct', 'independent')}]")
    with Database(answering) as opened:
        opened.apply_links(write(answering, both))
        (found,) = (
            opened.query("info-findings", where="name = 'contradictory_annotations'")
            .to_arrow()
            .to_pylist()
        )
    assert found["detail"].endswith("/in → /out (direct and independent)")
    assert rows(answering, COUNTED) == [("direct", 1, 9)]


@pytest.mark.thorough
def test_links_that_are_none_may_go_round(database: Path) -> None:
    """And name a topic on both sides."""
    text = """
links:
  - {kind: independent, node: /relay, inputs: /c, outputs: [/a, /c]}
  - {kind: direct, node: /fusion, inputs: /a, outputs: /c}
"""
    with Database(database) as opened:
        (applied,) = opened.apply_links(write(database, text))
    assert applied.annotation_count == 2
    assert rows(database, KINDS) == [("direct", 4)]
    assert rows(database, "SELECT count(*) FROM annotation_firing") == [(0,)]


@pytest.mark.thorough
def test_what_follows_from_responses_stays(empty_database: Path, tmp_path: Path) -> None:
    """Whatever is declared of callbacks: what these publish, the thread does not by itself."""
    system = RosSystem()
    asking = Thread(100, name="asking")
    system.node(asking, 0x1, "asking")
    system.subscription(asking, 0x11, "/in", callback=0xC1, node=0x1)
    system.publisher(asking, 0x21, "/out", node=0x1)
    system.client(asking, 0x31, "/add", gid=7, node=0x1)
    system.take(asking, 0x11, 1)
    system.start(asking, 0xC1)
    system.publish(asking, 0x21, 101)
    system.end(asking, 0xC1)
    system.ready(asking)
    system.take_response(asking, 0x31, 1, stamp=1)
    system.publish(asking, 0x21, 102)
    analysis = Analysis(empty_database, tmp_path)
    analysis.build(system)
    analysis.close()
    path = tmp_path / "analysis.duckdb"
    calls = "SELECT publication_id, candidate_count FROM link_call"
    ((_, certain),) = before = rows(path, calls)
    assert certain == 1
    with Database(path) as opened:
        text = ANSWERS.replace("direct", "independent").replace("/filter", "/asking")
        opened.apply_links(write(path, text))
    assert rows(path, KINDS) == []
    assert rows(path, calls) == before
