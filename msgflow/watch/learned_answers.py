"""What windows have shown of nodes without traced callbacks: which topics they answer."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import duckdb

from msgflow.files.yaml_file import quoted
from msgflow.links.links_file import LinksFile, read_links

LEARNED_FILE = "links.yaml"
_PAIRS = """
SELECT
    main.node_name(n.full_name), o.pid, h.hostname, s.topic_name, p.topic_name,
    2 * count(*) FILTER (l.candidate_count = 1) >= count(*)
FROM store.link_causal AS l
JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
JOIN store.subscription AS s ON l.subscription_id = s.subscription_id
JOIN store.node AS n ON p.node_id = n.node_id
JOIN store.process AS o ON n.process_id = o.process_id
JOIN store.host AS h ON o.host_id = h.host_id
WHERE l.kind = 'take_adjacent' AND NOT p.is_internal AND NOT s.is_internal
    AND n.full_name IS NOT NULL AND s.topic_name IS NOT NULL AND p.topic_name IS NOT NULL
GROUP BY ALL
"""


class LearnedAnswers:
    """Which topics nodes of rclpy answer, by the windows so far.

    A window has few messages. When a node becomes slow, its answers look like the work of a timer
    for a while, and an alarm would come late. What it does with messages has not changed: if more
    windows said that it answers than doubted it, it still does.
    """

    def __init__(self) -> None:
        # By node, pid, host, a topic that the node hears, and one that it publishes.
        self._scores: Counter[tuple[Any, ...]] = Counter()

    def doubted(self, con: duckdb.DuckDBPyConnection) -> str | None:
        """Learn from a window; return a file of links: what it doubts and earlier ones showed."""
        verdicts = {tuple(pair): verdict for *pair, verdict in con.execute(_PAIRS).fetchall()}
        doubted = sorted(
            pair for pair, is_answer in verdicts.items() if not is_answer and self._scores[pair] > 0
        )
        for pair, is_answer in verdicts.items():
            self._scores[pair] += 1 if is_answer else -1
        if not doubted:
            return None
        return "\n".join(["links:", *(_entry(*pair) for pair in doubted), ""])


def _entry(node: str, pid: int, host: str, heard: str, published: str) -> str:
    return (
        f"  - {{kind: direct, node: {quoted(node)}, process: {pid}, host: {quoted(host)},"
        f" inputs: [{quoted(heard)}], outputs: [{quoted(published)}]}}"
    )


def with_learned(links: LinksFile | None, learned: str) -> LinksFile:
    """Return links that a user declared, if any, with those that were learned."""
    file = read_links(Path(LEARNED_FILE), learned)
    return file if links is None else replace(links, links=(*links.links, *file.links))
