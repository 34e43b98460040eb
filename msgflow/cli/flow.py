"""Print the flow of one message: what caused it, and what it caused."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from msgflow.cli.operation import extends, header_option
from msgflow.cli.options import OUTPUT, SELECTION, one_text
from msgflow.cli.output import (
    print_drawing,
    print_note,
    print_result,
    print_runs,
    print_status,
    print_text,
)
from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.export.formats import Format, by_suffix
from msgflow.query.catalogue import load_query
from msgflow.sql.statement import internal_sql
from msgflow.text.values import format_duration

if TYPE_CHECKING:
    from msgflow.export.flow import Flow

FlowFormat = Literal["table", "json", "html"]
"""Formats of a flow: a tree, nodes and edges for programs, a timeline for a browser."""
_SUFFIXES: dict[str, FlowFormat] = {
    ".txt": "table",
    ".json": "json",
    ".html": "html",
    ".htm": "html",
}
_DECLARED = {param.name: param for param in internal_sql().header("flow_steps").params}
_OF_WHY = {param.name: param for param in load_query("critical-path").params}


@extends(Database.flow)
def command(
    database: Database,
    place: str | None = None,
    *,
    slowest: Annotated[int | None, typer.Option(min=1, max=100)] = None,
    why: bool = False,
    by: Annotated[str | None, header_option(_OF_WHY["by"], OUTPUT)] = None,
    detail: Annotated[str | None, header_option(_OF_WHY["detail"], OUTPUT)] = None,
    case: str | None = None,
    from_: list[str] | None = None,
    to: list[str] | None = None,
    direction: Annotated[str | None, header_option(_DECLARED["direction"], SELECTION)] = None,
    depth: Annotated[str | None, header_option(_DECLARED["depth"], SELECTION)] = None,
    limit: Annotated[str | None, header_option(_DECLARED["limit"], SELECTION)] = None,
    absolute: bool = False,
    form: FlowFormat | None = None,
    wide: bool = False,
    output: Path | None = None,
    **asked: Any,
) -> None:
    """A line is a publication, a taken message with its callback, a request, or a response that its
    client took.

    Times count from the first line. NA means that the trace does not show it.

    Args:
        place: The first message on this topic, or what this node did first, at or after --at; or
            one of the options below.
        slowest (N): The N slowest flows, each back from its last message.
        why: What the message waited for, as the query critical-path has it.
        case: With --slowest or --why: flows that count: first or last arrival of each root, newest
            root of each arrival, or all.
        from_: With --slowest or --why: where flows start; globs.
        to: With --slowest: where flows end; globs.
        absolute: Show points in time, in UTC.
        form (table|json|html): A tree, nodes and edges, or a page with its timeline; by default by
            the suffix of FILE, else table.
    """
    if form is None and output is not None and output.suffix:
        form = by_suffix(output, _SUFFIXES)
    run, internal = asked.pop("run", None), asked.pop("internal")
    start = asked if place is None else {"place": place, **asked}
    tree = _given(direction=direction, depth=depth, limit=limit)
    if why:
        _require_rows(start, tree, absolute, form, slowest)
    elif by or detail:
        raise UsageError("--by and --detail are about rows; a flow is a tree", "add --why")
    elif wide:
        raise UsageError("--wide shows all columns of a table; a flow is a tree", "--why --wide")
    rows = []
    if slowest is None:
        if to:
            raise UsageError("--to chooses among the slowest flows", "--slowest 1")
        if (from_ or case) and not why:
            raise UsageError("--from and --case choose among flows", "--slowest 1, or --why")
        starts = [start | {"run": run}]
    else:
        _require_choice(start, slowest, form)
        chosen = _given(from_=one_text(from_), to=one_text(to), case=case)
        rows = _slowest(database, run=run, internal=internal, slowest=slowest, **chosen)
        starts = [{"take_id": number} for number in dict.fromkeys(row["take_id"] for row in rows)]
        tree = {"direction": "backward"} | tree
    if why:
        counted = case or ("every_pair" if slowest is None else "first")
        begin = one_text(from_) if slowest is None else None
        words = _given(from_=begin, by=by, detail=detail)
        result = database.flow_why(**starts[0], case=counted, internal=internal, **words)
        print_result(result, None if form is None else Format(form), output, wide=wide)
        return
    flows = [database.flow(**each, internal=internal, **tree) for each in starts]
    if form == "html":
        _write_page(database, flows[0], output or Path("flow.html"))
        return
    # A pager may read the rest of it for long: others can write to the database meanwhile.
    database.close()
    print_runs([flows[0].run])
    if form == "json":
        print_text(flows[0].to_json(), output)
    else:
        _print_trees(flows, output, is_absolute=absolute)
    for rank, row in enumerate(rows, start=1):
        took = format_duration(row["latency_ns"])
        print_note(f"slowest flow {rank}: {took} to take {row['take_id']}, {row['path']}")
    for note in dict.fromkeys(note for flow in flows for note in flow.notes):
        print_note(note)


def _given(**words: Any) -> dict[str, Any]:
    return {name: value for name, value in words.items() if value}


def _require_rows(
    start: dict[str, Any],
    tree: dict[str, Any],
    absolute: bool,
    form: FlowFormat | None,
    slowest: int | None,
) -> None:
    """Refuse what does not go with --why, which answers with rows about one flow."""
    refused = [*tree, *(name for name in ("request", "response") if f"{name}_id" in start)]
    if "goal" in start:
        raise UsageError("--why is about a message", f"msgflow why --goal {start['goal']}")
    if absolute:
        refused.append("absolute")
    if refused:
        raise UsageError(f"--why goes without --{refused[0]}", "leave out one of them")
    if form == "html":
        raise UsageError("--why writes rows, no page", "--format table or json")
    if slowest is not None and slowest > 1:
        raise UsageError(
            f"--why is about one flow — --slowest {slowest}",
            f"msgflow query critical-path --slowest {slowest}",
        )


def _require_choice(start: dict[str, Any], slowest: int, form: FlowFormat | None) -> None:
    """Refuse what does not go with --slowest."""
    if slowest > 1 and form in ("json", "html"):
        raise UsageError(f"a file has one flow — --slowest {slowest}", "--slowest 1, or a tree")
    if start:
        raise UsageError(
            f"--slowest chooses the message itself — {next(iter(start))}", "leave out one of them"
        )


def _slowest(database: Database, **chosen: Any) -> list[dict[str, Any]]:
    """Return the rows of the slowest flows that arrived."""
    listed = database.query("flows", **chosen).to_arrow().to_pylist()
    rows = [row for row in listed if row["take_id"] is not None]
    if not rows:
        raise UsageError(
            "no flow arrived at the end of a path", "msgflow query e2e-latency lists the paths"
        )
    return rows


def _write_page(database: Database, flow: Flow, output: Path) -> None:
    size = database.flow_page(flow, output)
    print_runs([flow.run])
    print_status(f"{size:,} bytes written to {output}: open it in a browser")


def _print_trees(flows: list[Flow], output: Path | None, *, is_absolute: bool) -> None:
    from msgflow.export.flow import tree_text

    def draw(width: int | None, color: bool) -> str:
        trees = (
            tree_text(flow, is_absolute=is_absolute, width=width, color=color) for flow in flows
        )
        return "\n\n".join(trees)

    print_drawing(draw, output)
