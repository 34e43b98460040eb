"""Indirect links that `msgflow links suggest` finds, compared with those that nodes declare.

`compare` ingests a trace twice: with the declarations of its nodes, and without them. A link is
(kind, node, input, output). Links of a doubtful candidate are listed as doubtful too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow import open_db
from msgflow.sim.entity import (
    MILLISECOND,
    SECOND,
    MessageLink,
    Publisher,
    Subscription,
    Timer,
    Work,
)
from msgflow.sim.system import Host, Node, Process, Scenario

if TYPE_CHECKING:
    from pathlib import Path

_PERIODS = {"/a": 7, "/b": 11, "/c": 16, "/d": 23}
Link = tuple[str, str, str, str]

_DECLARED = """
SELECT DISTINCT a.kind, n.full_name, s.topic_name, p.topic_name
FROM annotation AS a
JOIN annotation_input AS i ON a.annotation_id = i.annotation_id
JOIN annotation_output AS o ON a.annotation_id = o.annotation_id
JOIN subscription AS s ON i.subscription_id = s.subscription_id
JOIN publisher AS p ON o.publisher_id = p.publisher_id
JOIN node AS n ON s.node_id = n.node_id
"""


def merges() -> Scenario:
    """Return nodes with several links, shared subscriptions, and four inputs."""
    nodes = (
        _merge("four", (("/a", "/b", "/c", "/d"), ("/four/0",))),
        _merge("four_to_four", (("/a", "/b", "/c", "/d"), tuple(f"/n_to_m/{n}" for n in range(4)))),
        _merge("two_pairs", (("/a", "/c"), ("/pairs/0",)), (("/b", "/d"), ("/pairs/1",))),
        _merge("shared", (("/a", "/b"), ("/shared/0",)), (("/b", "/c"), ("/shared/1",))),
        _merge("inside", (("/a", "/b", "/c"), ("/inside/0",)), (("/b", "/c"), ("/inside/1",))),
        Node(
            "kept",
            publishers=(Publisher("/kept/0"), Publisher("/kept/1")),
            subscriptions=tuple(Subscription(topic) for topic in _PERIODS),
            timers=(
                Timer(13 * MILLISECOND, ("/kept/0",)),
                Timer(29 * MILLISECOND, ("/kept/1",)),
            ),
            links=(
                MessageLink("periodic_async", ("/a", "/b"), ("/kept/0",)),
                MessageLink("periodic_async", ("/c", "/d"), ("/kept/1",)),
            ),
        ),
        # A driver: it obeys commands, and publishes its sensors.
        Node(
            "driver",
            publishers=(Publisher("/imu"), Publisher("/camera")),
            subscriptions=(Subscription("/a"),),
            timers=(
                Timer(13 * MILLISECOND, ("/imu",)),
                Timer(29 * MILLISECOND, ("/camera",)),
            ),
        ),
    )
    sources = tuple(
        Node(
            f"source{topic.replace('/', '_')}",
            publishers=(Publisher(topic),),
            timers=(Timer(period * MILLISECOND, (topic,)),),
        )
        for topic, period in _PERIODS.items()
    )
    return Scenario(
        name="merges",
        description="Nodes with several indirect links.",
        hosts=(Host("alpha", cpu_count=8),),
        processes=tuple(
            Process(node.name, "alpha", 1101 + 100 * number, (node,))
            for number, node in enumerate((*sources, *nodes))
        ),
        duration_ns=4 * SECOND,
        layout="rolling",
    )


def _merge(name: str, *links: tuple[tuple[str, ...], tuple[str, ...]]) -> Node:
    inputs = sorted({topic for topics, _ in links for topic in topics})
    return Node(
        name,
        publishers=tuple(Publisher(topic) for _, outputs in links for topic in outputs),
        subscriptions=tuple(
            Subscription(
                topic,
                tuple(each for topics, outputs in links if topic in topics for each in outputs),
                Work(MILLISECOND),
            )
            for topic in inputs
        ),
        links=tuple(MessageLink("partial_sync", topics, outputs) for topics, outputs in links),
    )


def compare(trace: Path, directory: Path) -> dict[str, tuple[set[Link], set[Link], set[Link]]]:
    """Return for each node its declared links, those suggested, and those of them in doubt."""
    with open_db(directory / "declared.duckdb") as database:
        database.ingest(trace)
        declared = {tuple(row.values()) for row in database.sql(_DECLARED).to_arrow().to_pylist()}
    suggested, doubtful = set(), set()
    with open_db(directory / "plain.duckdb") as database:
        database.ingest(trace, ignore=["ros2:message_link_*"])
        for row in database.query("links-suggested").to_arrow().to_pylist():
            links = {
                (row["kind"], row["node"], each, output)
                for each in row["inputs"]
                for output in row["outputs"]
            }
            suggested |= links
            doubtful |= links if row["doubt"] else set()

    def of(node: str, links: set[Link]) -> set[Link]:
        return {link for link in links if link[1] == node}

    return {
        node: (of(node, declared), of(node, suggested), of(node, doubtful))
        for node in sorted({link[1] for link in declared | suggested})
    }
