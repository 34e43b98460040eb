"""Annotated nodes: what is declared in the trace, and what their publications are made of."""

from __future__ import annotations

import pytest
from support.thorough import few

from msgflow.errors import UsageError
from msgflow_sim import MessageLink, Node, Publisher, Subscription, scenarios
from msgflow_sim.system import Host, Process, Scenario

KINDS = ("periodic_async", "partial_sync")


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(KINDS, "partial_sync"))
def test_annotations_name_the_handles_of_their_objects(recordings, name):
    recording = recordings[name]
    topics = {
        (e.pid, e.host, e.fields[f"{kind}_handle"]): e.fields["topic_name"]
        for e in recording.events
        for kind in ("subscription", "publisher")
        if e.name == f"ros2:rcl_{kind}_init"
    }
    declared = sorted(
        (
            e.name.removeprefix("ros2:message_link_"),
            tuple(topics[e.pid, e.host, handle] for handle in e.fields["subs"]),
            tuple(topics[e.pid, e.host, handle] for handle in e.fields["pubs"]),
        )
        for e in recording.events
        if "message_link" in e.name
    )
    links = [
        (link.kind, link.inputs, link.outputs)
        for process in scenarios()[name].processes
        for node in process.nodes
        for link in node.links
    ]
    assert declared == sorted(links)
    assert {(len(inputs), len(outputs)) for _, inputs, outputs in links} >= {(1, 1), (3, 3)}


@pytest.mark.thorough
def test_a_periodic_publication_is_made_of_the_latest_that_had_ended(recordings):
    recording = recordings["periodic_async"]
    ((count, right),) = recording.truth(
        """
        SELECT count(*), count(*) FILTER (WHERE used.end_ns = (
            SELECT max(each.end_ns) FROM callback_instance AS each
            WHERE each.callback_handle = used.callback_handle AND each.pid = used.pid
                AND each.host = used.host AND each.end_ns <= coalesce(run.start_ns, 0)
        ))
        FROM causal AS c
        JOIN callback_instance AS used ON c.callback_instance_id = used.callback_instance_id
        JOIN publication AS p ON c.publication_id = p.publication_id
        JOIN callback_instance AS run ON p.callback_instance_id = run.callback_instance_id
        WHERE c.kind = 'periodic_async'
        """
    )
    assert count == right > 500
    # Some messages are used again, some not at all.
    assert recording.truth("SELECT DISTINCT is_reuse FROM causal ORDER BY 1") == [(False,), (True,)]


def test_a_synchronous_publication_uses_one_new_message_of_each_input(recordings):
    recording = recordings["partial_sync"]
    rows = recording.truth(
        """
        SELECT p.node, c.publication_id, count(DISTINCT i.callback_handle), count(*)
        FROM causal AS c
        JOIN publication AS p ON c.publication_id = p.publication_id
        JOIN callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
        WHERE p.node LIKE '/partial_%' AND NOT c.is_internal
        GROUP BY ALL
        """
    )
    inputs = {node: int(node.split("_")[1]) for node, *_ in rows}
    assert set(inputs.values()) == {1, 2, 3}
    assert all(inputs[node] == handles == count for node, _, handles, count in rows)
    # No message is used by two runs of a callback.
    assert (
        recording.truth(
            """
        SELECT c.callback_instance_id
        FROM causal AS c
        JOIN publication AS p ON c.publication_id = p.publication_id
        WHERE c.kind = 'partial_sync'
        GROUP BY c.callback_instance_id
        HAVING count(DISTINCT p.callback_instance_id) > 1
        """
        )
        == []
    )


def test_flows_go_on_through_caches_from_all_inputs(recordings):
    rows = recordings["periodic_async"].truth(
        "SELECT DISTINCT path[1] FROM end_to_end WHERE path[2] = '/periodic_3_to_3/0' ORDER BY 1"
    )
    assert rows == [("/a",), ("/b",), ("/c",)]
    # Nothing ends in a cache.
    assert recordings["periodic_async"].truth(
        "SELECT count(*) FROM end_to_end WHERE sink_node <> '/sink'"
    ) == [(0,)]


def test_autoware_has_the_shape_of_the_reference_system():
    (one, two) = (scenarios()[name] for name in ("autoware", "autoware_two_threads"))
    nodes = [node for process in one.processes for node in process.nodes]
    assert (len(one.processes), len(nodes)) == (11, 24)
    assert sum(link.kind == "partial_sync" for node in nodes for link in node.links) == 5
    assert sum(link.kind == "periodic_async" for node in nodes for link in node.links) == 1
    differing = [
        process.name
        for process, other in zip(one.processes, two.processes, strict=True)
        if process != other
    ]
    assert differing == ["autoware_1b"]


def _node(link, **subscriptions):
    return Node(
        "node",
        publishers=(Publisher("/out"),),
        subscriptions=tuple(Subscription(f"/{name}", out) for name, out in subscriptions.items()),
        links=(link,),
    )


def test_a_map_is_made_of_the_latest_transform_that_a_listener_heard(recordings):
    recording = recordings["rtabmap"]
    ((count, right),) = recording.truth(
        """
        SELECT count(*), count(*) FILTER (WHERE used.pid = p.pid
            AND used.node LIKE '/transform_listener_impl_%' AND used.end_ns = (
            SELECT max(each.end_ns) FROM callback_instance AS each
            WHERE each.callback_handle = used.callback_handle AND each.pid = used.pid
                AND each.host = used.host AND each.end_ns <= run.start_ns
        ))
        FROM causal AS c
        JOIN callback_instance AS used ON c.callback_instance_id = used.callback_instance_id
        JOIN publication AS p ON c.publication_id = p.publication_id
        JOIN callback_instance AS run ON p.callback_instance_id = run.callback_instance_id
        WHERE c.kind = 'periodic_async' AND p.topic_name = '/mapGraph'
        """
    )
    assert count == right > 10


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MessageLink("sometimes", ("/a",), ("/out",)), "no such kind of link — sometimes"),
        (lambda: MessageLink("partial_sync", (), ("/out",)), "inputs and outputs"),
        (lambda: _node(MessageLink("periodic_async", ("/b",), ("/out",)), a=()), "subscription"),
        (lambda: _node(MessageLink("periodic_async", ("/a",), ("/c",)), a=()), "publisher of /c"),
        (
            lambda: _node(MessageLink("partial_sync", ("/a", "/b"), ("/out",)), a=("/out",), b=()),
            "whatever input comes last",
        ),
        (
            lambda: _node(MessageLink("periodic_async", ("/a",), ("/out",), inputs_of="/b"), a=()),
            "no node before /node that fills its caches — /b",
        ),
    ],
)
def test_links_that_make_no_sense_are_refused(make, message):
    with pytest.raises(UsageError, match=message):
        Scenario("s", "", (Host("h"),), (Process("p", "h", 1, (make(),)),))
