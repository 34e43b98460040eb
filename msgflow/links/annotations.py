"""Annotations and topics of a run from a file, stored in place of those of an earlier file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pyarrow as pa

from msgflow.db.derivation import derive, learn_topics
from msgflow.links.matching import match_links, matches
from msgflow.sql.statement import internal_sql, registered

if TYPE_CHECKING:
    import duckdb

    from msgflow.errors import UsageError
    from msgflow.files.yaml_file import YamlFile
    from msgflow.links.links_file import DeclaredLink, DeclaredTopic, LinksFile
    from msgflow.run.choice import Run


@dataclass(frozen=True)
class AppliedLinks:
    """The links that a file declared for a run.

    Attributes:
        run: the run.
        annotation_count: declared links, one per node that an entry matches.
        known_count: those that the trace declares, too; they are not stored again.
        topic_count: topics that the file names.
        link_count: indirect links of messages that come from the file only.
        traced_link_count: indirect links of messages that come from the trace.
        without_effect: a sentence for each declared link that no message took.
    """

    run: Run
    annotation_count: int
    known_count: int
    topic_count: int
    link_count: int
    traced_link_count: int
    without_effect: tuple[str, ...]


def apply_links(
    con: duckdb.DuckDBPyConnection, runs: tuple[Run, ...], file: LinksFile
) -> tuple[AppliedLinks, ...]:
    """Declare the links of a file for runs of a database and derive their links anew."""
    counts = {run.run_id: declare_links(con, run.run_id, file) for run in runs}
    for run in runs:
        derive(con, run.run_id)
    applied = []
    for run in runs:
        of_run = {"run_id": run.run_id}
        ((of_file, of_trace),) = internal_sql().run(con, "link_source", of_run).fetchall()
        untaken = internal_sql().run(con, "link_without_effect", of_run).fetchall()
        sentences = tuple(
            f"no message took the link from {inputs} to {outputs} ({kind}): {reason}"
            for kind, inputs, outputs, reason in untaken
        )
        applied.append(AppliedLinks(run, *counts[run.run_id], of_file, of_trace, sentences))
    return tuple(applied)


def declare_links(
    con: duckdb.DuckDBPyConnection,
    run_id: int,
    file: LinksFile,
    leave_out: Callable[[DeclaredLink, UsageError], None] | None = None,
) -> tuple[int, int, int]:
    """Name topics, and store links as the annotations of a run, inside the open transaction.

    The caller derives the links between messages afterwards. `leave_out` gets links that do not fit
    the run, with the error; where it is None, that is raised. The numbers returned are those of
    annotations, of those that the trace declares, too, and of named topics.
    """
    topic_count = _declare_topics(con, run_id, file)
    matched = match_links(con, run_id, file, leave_out)
    ids = pa.list_(pa.int64())
    given = pa.table(
        {
            "kind": pa.array([link.kind for link in matched], pa.string()),
            "process_id": pa.array([link.process_id for link in matched], pa.int64()),
            "inputs": pa.array([[each.id for each in link.inputs] for link in matched], ids),
            "outputs": pa.array([[each.id for each in link.outputs] for link in matched], ids),
            "depth": pa.array([link.depth for link in matched], pa.int64()),
        }
    )
    with registered(con, matched=given):
        internal_sql().keep(con, "link_to_store", {"run_id": run_id})
    for table in ("annotation_input", "annotation_output", "annotation"):
        con.execute(
            f"DELETE FROM store.{table} WHERE run_id = $run_id AND annotation_id IN "
            "(SELECT annotation_id FROM store.annotation "
            "WHERE run_id = $run_id AND source = 'file')",
            {"run_id": run_id},
        )
    for table, columns in (
        ("annotation", "kind, 'file' AS source, process_id, depth AS queue_depth"),
        ("annotation_input", "unnest(inputs) AS subscription_id"),
        ("annotation_output", "unnest(outputs) AS publisher_id"),
    ):
        con.execute(
            f"INSERT INTO store.{table} BY NAME SELECT annotation_id, $run_id AS run_id, {columns} "
            "FROM link_to_store WHERE annotation_id IS NOT NULL",
            {"run_id": run_id},
        )
    ((total, known),) = con.execute(
        "SELECT count(*), count(*) - count(annotation_id) FROM link_to_store"
    ).fetchall()
    return total, known, topic_count


@dataclass(frozen=True)
class Unnamed:
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


def _declare_topics(con: duckdb.DuckDBPyConnection, run_id: int, file: LinksFile) -> int:
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
    endpoints = [Unnamed(*row) for row in rows]
    chosen = [(topic, _match(file.file, topic, endpoints)) for topic in file.topics]
    _refuse_contradictions(file.file, chosen)
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


def _match(file: YamlFile, topic: DeclaredTopic, endpoints: Sequence[Unnamed]) -> Unnamed:
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


def _refuse_contradictions(file: YamlFile, chosen: Sequence[tuple[DeclaredTopic, Unnamed]]) -> None:
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
