"""Write the graph of nodes, topics, services and actions, with rates and latencies."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from msgflow.cli.operation import parameters_of
from msgflow.cli.output import print_note, print_runs, print_text
from msgflow.cli.query_command import build_command, chosen_by, print_rows
from msgflow.export.formats import Format
from msgflow.run.choice import choose_one

if TYPE_CHECKING:
    from msgflow.export.graph import GraphFormat
    from msgflow.result.query_result import QueryResult


_OfGraphs = Literal["dot", "mermaid", "json"]
_OfRows = Literal["table", "csv", "csv-safe", "jsonl", "parquet", "markdown"]


def _options(*, form: Literal[_OfGraphs, _OfRows] | None = None) -> None:
    """Declare what differs from a query.

    Args:
        form (FORMAT): The graph as dot, mermaid or json; its rows as table, csv, csv-safe, jsonl,
            parquet, markdown. By default by the suffix of FILE, else dot.
    """


def asked(words: list[str]) -> Any:
    """Return the command of the query."""
    return build_command(
        chosen_by("graph", words), form=next(parameters_of(_options)), form_of=_form, write=_write
    )


def _form(form: str | None, path: Path | None) -> GraphFormat | Format:
    from msgflow.export.graph import GraphFormat, graph_format

    if form is None:
        return graph_format(path)
    return GraphFormat(form) if form in get_args(_OfGraphs) else Format(form)


def _write(result: QueryResult, form: Any, given: dict[str, Any]) -> None:
    from msgflow.export.graph import Graph

    if isinstance(form, Format):
        print_rows(result, form, given)
        return
    run = choose_one(result.runs, given["run"], "a graph")
    print_runs([run])
    print_text(Graph(run, result, result.notes).to(form), given["output"])
    if not len(result):
        print_note("nothing was sent or received")
    for note in result.notes:
        print_note(note)
