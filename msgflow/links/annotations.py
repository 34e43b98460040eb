"""Annotations and topics of a run from a file, stored in place of those of an earlier file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.db.derivation import derive
from msgflow.db.runs import change_runs
from msgflow.links.matching import match_links
from msgflow.links.topics import declare_topics
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    import duckdb

    from msgflow.errors import UsageError
    from msgflow.links.links_file import DeclaredLink, LinksFile
    from msgflow.links.matching import MatchedLink
    from msgflow.run.choice import Run


@dataclass(frozen=True)
class AppliedLinks:
    """The links that a file declared for a run."""

    run: Run
    annotation_count: int  # declared links, one per node that an entry matches
    known_count: int  # those that the trace declares, too; they are not stored again
    topic_count: int  # topics that the file names
    link_count: int  # indirect links of messages that come from the file only
    traced_link_count: int  # indirect links of messages that come from the trace
    without_effect: tuple[str, ...]  # a sentence for each declared link that no message took


def apply_links(
    path: Path, file: LinksFile, *, run: str | int | None, memory_limit: str | None = None
) -> tuple[AppliedLinks, ...]:
    """Declare the links of a file for runs of a database and derive their links anew."""

    def apply(con: duckdb.DuckDBPyConnection, runs: tuple[Run, ...]) -> tuple[AppliedLinks, ...]:
        counts = {run.run_id: declare_links(con, run.run_id, file) for run in runs}
        for run in runs:
            derive(con, run.run_id)
        return tuple(
            AppliedLinks(
                run,
                *counts[run.run_id],
                *internal_sql().run(con, "link_source", {"run_id": run.run_id}).fetchall()[0],
                tuple(_without_effect(con, run.run_id)),
            )
            for run in runs
        )

    return change_runs(path, run, apply, memory_limit=memory_limit)


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
    topic_count = declare_topics(con, run_id, file)
    matched = match_links(con, run_id, file, leave_out)
    # Before we delete any: one transaction cannot use a key twice.
    ((first,),) = con.execute(
        "SELECT coalesce(max(annotation_id), 0) + 1 FROM store.annotation"
    ).fetchall()
    for table in ("annotation_input", "annotation_output", "annotation"):
        con.execute(
            f"DELETE FROM store.{table} WHERE run_id = $run_id AND annotation_id IN "
            "(SELECT annotation_id FROM store.annotation "
            "WHERE run_id = $run_id AND source = 'file')",
            {"run_id": run_id},
        )
    unique = {_key(link): link for link in matched}
    traced = {
        (kind, process_id, tuple(inputs or ()), tuple(outputs or ()))
        for kind, process_id, inputs, outputs in internal_sql()
        .run(con, "link_declared", {"run_id": run_id})
        .fetchall()
    }
    added = [link for key, link in unique.items() if key not in traced]
    for annotation_id, link in enumerate(added, start=first):
        _insert(con, run_id, annotation_id, link)
    return len(unique), len(unique) - len(added), topic_count


def _insert(
    con: duckdb.DuckDBPyConnection, run_id: int, annotation_id: int, link: MatchedLink
) -> None:
    con.execute(
        "INSERT INTO store.annotation "
        "(annotation_id, run_id, kind, source, process_id, queue_depth) "
        "VALUES (?, ?, ?, 'file', ?, ?)",
        [annotation_id, run_id, link.kind, link.process_id, link.depth],
    )
    for table, column, endpoints in (
        ("annotation_input", "subscription_id", link.inputs),
        ("annotation_output", "publisher_id", link.outputs),
    ):
        con.execute(
            f"INSERT INTO store.{table} (run_id, annotation_id, {column}) "
            "SELECT ?, ?, unnest(?::BIGINT[])",
            [run_id, annotation_id, [endpoint.id for endpoint in endpoints]],
        )


def _key(link: MatchedLink) -> tuple[str, int, tuple[int, ...], tuple[int, ...]]:
    return (
        link.kind,
        link.process_id,
        tuple(endpoint.id for endpoint in link.inputs),
        tuple(endpoint.id for endpoint in link.outputs),
    )


def _without_effect(con: duckdb.DuckDBPyConnection, run_id: int) -> Iterator[str]:
    found = internal_sql().run(con, "link_without_effect", {"run_id": run_id}).fetchall()
    for kind, inputs, outputs, reason in found:
        yield f"no message took the link from {inputs} to {outputs} ({kind}): {reason}"
