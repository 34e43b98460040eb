"""Declare indirect links: how nodes use messages they keep; without a command: list."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from msgflow.cli.operation import operation
from msgflow.cli.output import print_note, print_runs, print_status
from msgflow.cli.query_command import AskingGroup
from msgflow.database import Database
from msgflow.text.values import count

if TYPE_CHECKING:
    from msgflow.links.annotations import AppliedLinks


app = typer.Typer(cls=AskingGroup)


@app.command("apply")
@operation
def apply(database: Database, file: Path, *, run: str | None = None) -> None:
    """Declare the links and topics of a file and derive all links of the run again.

    The trace is not needed.

    Args:
        file: Links to declare, as YAML.
    """
    for one in database.apply_links(file, run=run):
        print_runs([one.run])
        print_applied(database, one)


def print_applied(database: Database, one: AppliedLinks) -> None:
    """Print what was declared, and what contradicts it."""
    known = f", {one.known_count} of them by the trace itself" if one.known_count else ""
    traced = f", and {one.traced_link_count} that the trace declares itself"
    if one.topic_count:
        print_status(f"{count(one.topic_count, 'topic')} named")
    print_status(
        f"{count(one.annotation_count, 'link')} declared{known}:"
        f" {count(one.link_count, 'indirect link')} between messages"
        f"{traced if one.traced_link_count else ''}"
    )
    for sentence in one.without_effect:
        print_note(sentence)
    findings = database.query(
        "info-findings", run=one.run.run_id, where="name = 'contradictory_annotations'"
    )
    for finding in findings.to_arrow().to_pylist():
        print_note(f"{finding['name']} ({finding['count']}): {finding['detail']}")
