"""Indirect links that `msgflow suggest links` finds, compared with those that nodes declare.

`compare` ingests a trace twice: with the declarations of its nodes, and without them, where it
applies what is suggested without a doubt.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from msgflow import open_db
from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    MessageLink,
    Publisher,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim.system import Host, Node, Process, Scenario

if TYPE_CHECKING:
    from pathlib import Path

    from msgflow import Database

_PERIODS = {"/a": 7, "/b": 11, "/c": 16, "/d": 23}
_LINKS = """
SELECT n.full_name, s.topic_name, p.topic_name, l.callback_instance_id, l.publication_id,
    l.candidate_count > 1 AS is_marked
FROM link_causal AS l
JOIN callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
JOIN callback AS c ON i.callback_id = c.callback_id
JOIN subscription AS s ON c.subscription_id = s.subscription_id
JOIN publication AS b ON l.publication_id = b.publication_id
JOIN publisher AS p ON b.publisher_id = p.publisher_id
JOIN node AS n ON p.node_id = n.node_id
WHERE l.annotation_id IS NOT NULL
"""


@dataclass(frozen=True)
class Compared:
    """What is suggested for a node, beside what it declares.

    Attributes:
        missing: pairs of input and output with links that nothing suggests, not even in doubt.
        wrong: links of suggestions without a doubt that it does not declare, if no mark of the link
            says that another message may be the right one.
        found: links between messages that suggestions without a doubt have in common with it.
    """

    missing: int
    wrong: int
    found: int


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


def compare(trace: Path, directory: Path) -> dict[str, Compared]:
    """Return for each node how its declarations and the suggestions differ."""

    def links(database: Database) -> set[tuple[Any, ...]]:
        return {tuple(row.values()) for row in database.sql(_LINKS).to_arrow().to_pylist()}

    with open_db(directory / "declared.duckdb") as database:
        database.ingest(trace)
        declared = links(database)
    with open_db(directory / "plain.duckdb") as database:
        database.ingest(trace, ignore=["ros2:message_link_*"])
        suggestions = database.suggest_links()
        database.apply_links("links.yaml", content=suggestions.text("msgflow links apply FILE"))
        applied = links(database)
    suggested = {
        (row["node"], each, output)
        for row in suggestions.candidates
        for each in row["inputs"]
        for output in row["outputs"]
    }
    missing = {link[:3] for link in declared} - suggested
    known = {link[:5] for link in declared}
    wrong = {link for link in applied if link[:5] not in known and not link[5]}
    return {
        node: Compared(
            *(
                len([link for link in each if link[0] == node])
                for each in (missing, wrong, applied & declared)
            )
        )
        for node in sorted({link[0] for link in declared | applied})
    }
