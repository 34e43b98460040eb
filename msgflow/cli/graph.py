"""`msgflow graph`: the graph of nodes and topics, for programs that draw it."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

from msgflow.cli.options import (
    DatabaseOption,
    InternalOption,
    OutputOption,
    format_option,
)
from msgflow.cli.slice_options import with_slice
from msgflow.export.graph import GraphFormat
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.run.slice import LATEST, Slice


@with_slice()
def command(
    part: Slice = LATEST,
    internal: InternalOption = False,
    form: Annotated[
        GraphFormat | None,
        format_option("A graph language, or JSON", show_default="by the suffix of FILE, else dot"),
    ] = None,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write the graph of nodes, topics, services and actions, with rates and latencies.

    Topics show their rate. Arrows to receivers show median and p95 from
    publication to take, arrows to services those of the round trip. Dashed
    (periodic_async) and dotted (partial_sync, approximate_sync) arrows lead to what
    an indirect link causes. Nodes of one executor stand together.
    """
    from msgflow.cli.output import print_note, print_runs, print_text
    from msgflow.database import Database
    from msgflow.export.graph import graph_format

    form = form or graph_format(output)
    with Database(database) as opened:
        graph = opened.graph(**asdict(part), internal=internal)
    print_runs([graph.run])
    print_text(graph.to(form), output)
    if not graph.rows:
        print_note("nothing was sent or received")
    for note in graph.notes:
        print_note(note)
