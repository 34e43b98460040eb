"""Names that a file gives to topics for which the trace has none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.db.derivation import learn_topics
from msgflow.links.matching import matches
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb

    from msgflow.links.links_file import DeclaredTopic, LinksFile


@dataclass(frozen=True)
class Endpoint:
    """A publisher or subscription whose topic the trace does not name."""

    kind: str  # 'publisher' or 'subscription'
    id: int
    handle: int
    topic: str | None  # what messages say about its topic; None: nothing
    group: int  # messages join all endpoints of a group: they are on one topic
    process: str | None  # name of its process
    pid: int  # id of its process
    host: str

    def fits(self, topic: DeclaredTopic) -> bool:
        """Tell whether an entry of a file means this one."""
        return (
            (self.kind, self.handle) == (topic.kind, topic.handle)
            and (
                topic.process is None
                or str(self.pid) == topic.process.value
                or matches(self.process or "", topic.process.value)
            )
            and (topic.host is None or matches(self.host, topic.host.value))
        )


def declare_topics(con: duckdb.DuckDBPyConnection, run_id: int, file: LinksFile) -> int:
    """Name the topics of a run as a file does, in place of an earlier file; return how many.

    Messages tell the names to all that they join. This happens inside the open transaction.
    """
    for kind in ("publisher", "subscription"):
        con.execute(
            f"UPDATE store.{kind} SET topic_name = NULL, is_internal = false, "
            "is_topic_declared = false WHERE run_id = ? AND is_topic_declared",
            [run_id],
        )
    learn_topics(con, run_id)
    if not file.topics:
        return 0
    rows = internal_sql().run(con, "unnamed_endpoint", {"run_id": run_id}).fetchall()
    endpoints = [Endpoint(*row) for row in rows]
    chosen = [(topic, _match(file, topic, endpoints)) for topic in file.topics]
    _refuse_contradictions(file, chosen)
    for topic, endpoint in chosen:
        con.execute(
            f"UPDATE store.{endpoint.kind} SET topic_name = $name, is_topic_declared = true, "
            "is_topic_learned = false, is_internal = EXISTS (FROM main.topic "
            "WHERE run_id = $run_id AND topic_name = $name AND is_internal) "
            f"WHERE {endpoint.kind}_id = $id",
            {"name": topic.name.value, "run_id": run_id, "id": endpoint.id},
        )
    learn_topics(con, run_id)
    return len({topic.name.value for topic in file.topics})


def _match(file: LinksFile, topic: DeclaredTopic, endpoints: Sequence[Endpoint]) -> Endpoint:
    found = [endpoint for endpoint in endpoints if endpoint.fits(topic)]
    if not found:
        file.fail(
            topic.handle_text.line,
            f"no {topic.kind} without a topic has this handle — {topic.handle_text.value}",
            "handles are those of one recording: msgflow check shows them, in topic_unnamed",
        )
    if len(found) > 1:
        places = ", ".join(f"{one.process or '?'} {one.pid} on {one.host}" for one in found)
        file.fail(
            topic.handle_text.line,
            f"{len(found)} {topic.kind}s have this handle — {topic.handle_text.value}",
            f"say which with process: and host: — {places}",
        )
    return found[0]


def _refuse_contradictions(
    file: LinksFile, chosen: Sequence[tuple[DeclaredTopic, Endpoint]]
) -> None:
    """Raise if one topic would have two names."""
    first: dict[int, DeclaredTopic] = {}
    for topic, endpoint in chosen:
        name = topic.name
        if endpoint.topic not in (None, name.value):
            file.fail(
                name.line,
                f"messages show that this {topic.kind} is on {endpoint.topic} — {name.value}",
                "leave the entry out",
            )
        before = first.setdefault(endpoint.group, topic).name
        if before.value != name.value:
            file.fail(
                name.line,
                f"line {before.line} calls the same topic {before.value} — {name.value}",
                "messages join the two: give them one name, or leave out one entry",
            )
