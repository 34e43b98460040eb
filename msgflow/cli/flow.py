"""`msgflow flow`: where one message came from and where it went, as a tree."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.completion import complete
from msgflow.cli.options import (
    DEFAULT_DATABASE,
    OUTPUT,
    SELECTION,
    DatabaseOption,
    InternalOption,
    OutputOption,
    RunOption,
)
from msgflow.errors import UsageError

_START = "Which message"


class FlowFormat(StrEnum):
    """How a flow is written: a tree for people, nodes and edges for programs."""

    TABLE = "table"
    JSON = "json"


class Direction(StrEnum):
    """Which way a flow is followed."""

    FORWARD = "forward"
    BACKWARD = "backward"
    BOTH = "both"


def command(
    topic: Annotated[
        str | None,
        typer.Option(
            "--topic",
            metavar="NAME",
            help="Topic",
            autocompletion=complete("topic"),
            rich_help_panel=_START,
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            "--at",
            metavar="TIME",
            help="First message on the topic at or after TIME: seconds from the start of the run,"
            " ISO time, or epoch ns (16 digits or more)",
            show_default="its first message",
            rich_help_panel=_START,
        ),
    ] = None,
    publication: Annotated[
        int | None,
        typer.Option("--publication", metavar="ID", help="publication_id", rich_help_panel=_START),
    ] = None,
    take: Annotated[
        int | None,
        typer.Option("--take", metavar="ID", help="take_id", rich_help_panel=_START),
    ] = None,
    callback_instance: Annotated[
        int | None,
        typer.Option(
            "--callback-instance",
            metavar="ID",
            help="callback_instance_id",
            rich_help_panel=_START,
        ),
    ] = None,
    request: Annotated[
        int | None,
        typer.Option("--request", metavar="ID", help="request_id", rich_help_panel=_START),
    ] = None,
    response: Annotated[
        int | None,
        typer.Option("--response", metavar="ID", help="response_id", rich_help_panel=_START),
    ] = None,
    run: RunOption = None,
    direction: Annotated[
        Direction,
        typer.Option(
            "--direction",
            help="Follow what it caused, what caused it, or both",
            rich_help_panel=SELECTION,
        ),
    ] = Direction.BOTH,
    depth: Annotated[
        int,
        typer.Option(
            "--depth",
            metavar="N",
            min=0,
            help="Maximum number of messages in a row, each way",
            rich_help_panel=SELECTION,
        ),
    ] = 32,
    limit: Annotated[
        int,
        typer.Option(
            "--limit",
            metavar="N",
            min=1,
            max=10_000,
            help="Maximum number of publications, takes, callback instances, requests and"
            " responses",
            rich_help_panel=SELECTION,
        ),
    ] = 1_000,
    internal: InternalOption = False,
    absolute: Annotated[
        bool,
        typer.Option(
            "--absolute",
            help="Show points in time (UTC) instead of times since the first line",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    form: Annotated[
        FlowFormat | None,
        typer.Option(
            "--format",
            help="A tree, or nodes and edges",
            show_default="by the suffix of FILE, else table",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    output: OutputOption = None,
    html: Annotated[
        Path | None,
        typer.Option(
            "--html",
            metavar="FILE.html",
            help="Write its timeline to one file for any browser, and print nothing",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Print the flow of one message: what caused it, and what it caused.

    A line is a publication, a taken message with its callback, a request, or a
    response that its client took.

    Times count from the first line. NA means that the trace does not show it.
    """
    from msgflow.cli.output import print_note, print_runs, print_status, print_text
    from msgflow.database import Database
    from msgflow.export.formats import by_suffix

    if form is None and output is not None and output.suffix:
        form = by_suffix(output, {".txt": FlowFormat.TABLE, ".json": FlowFormat.JSON})
    if html is not None and html.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"a page has a name that ends with .html — {html}", "--html FILE.html")
    if html is not None and (output is not None or form is not None):
        raise UsageError("--html goes without --format and -o", "ask twice")
    with Database(database) as opened:
        flow = opened.flow(
            topic,
            at=at,
            publication_id=publication,
            take_id=take,
            callback_instance_id=callback_instance,
            request_id=request,
            response_id=response,
            run=run,
            direction=direction.value,
            depth=depth,
            limit=limit,
            internal=internal,
        )
        size = None if html is None else opened.flow_page(flow, html)
    print_runs([flow.run])
    if size is not None:
        print_status(f"{size:,} bytes written to {html}: open it in a browser")
        return
    if form is FlowFormat.JSON:
        print_text(lambda width, color: flow.to_json(), output)
    else:
        from msgflow.export.flow_tree import tree_text

        print_text(
            lambda width, color: tree_text(flow, is_absolute=absolute, width=width, color=color),
            output,
        )
    for note in flow.notes:
        print_note(note)
