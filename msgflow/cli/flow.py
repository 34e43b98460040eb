"""`msgflow flow`: the way of one message as a tree: where it came from, and where it went."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from msgflow.cli.header_options import header_option
from msgflow.cli.operation import operation
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
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.query.catalogue import load_query
from msgflow.sql.statement import internal_sql
from msgflow.text.values import format_duration


class FlowFormat(StrEnum):
    """Formats of a flow: a tree, nodes and edges for programs, a timeline for a browser."""

    TABLE = "table"
    JSON = "json"
    HTML = "html"


_SUFFIXES = {
    ".txt": FlowFormat.TABLE,
    ".json": FlowFormat.JSON,
    ".html": FlowFormat.HTML,
    ".htm": FlowFormat.HTML,
}


_DECLARED = {param.name: param for param in internal_sql().header("flow_steps").params}
_OF_WHY = {param.name: param for param in load_query("critical-path").params}


@operation
def command(
    place: str | None = None,
    *,
    at: str | None = None,
    publication: int | None = None,
    take: int | None = None,
    callback_instance: int | None = None,
    request: int | None = None,
    response: int | None = None,
    slowest: Annotated[int | None, typer.Option(min=1, max=100)] = None,
    why: bool = False,
    by: Annotated[str | None, header_option(_OF_WHY["by"], OUTPUT)] = None,
    detail: Annotated[str | None, header_option(_OF_WHY["detail"], OUTPUT)] = None,
    case: str | None = None,
    from_: list[str] | None = None,
    to: list[str] | None = None,
    run: str | None = None,
    direction: Annotated[str | None, header_option(_DECLARED["direction"], SELECTION)] = None,
    depth: Annotated[str | None, header_option(_DECLARED["depth"], SELECTION)] = None,
    limit: Annotated[str | None, header_option(_DECLARED["limit"], SELECTION)] = None,
    internal: bool = False,
    absolute: bool = False,
    form: FlowFormat | None = None,
    wide: bool = False,
    output: Path | None = None,
    database: Path = DEFAULT_DATABASE,
) -> None:
    """Print the flow of one message: what caused it, and what it caused.

    A line is a publication, a taken message with its callback, a request, or a response that its
    client took.

    Times count from the first line. NA means that the trace does not show it.

    Args:
        place: Topic of the message, or node; or one of the options below.
        at (TIME): The first one then or after: seconds from the start of the run, ISO time, or ns.
        publication (ID): publication_id.
        take (ID): take_id.
        callback_instance (ID): callback_instance_id.
        request (ID): request_id.
        response (ID): response_id.
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
    if form is FlowFormat.HTML and output is None:
        output = Path("flow.html")
    if slowest is None and to:
        raise UsageError("--to chooses among the slowest flows", "--slowest 1")
    if slowest is None and (from_ or case) and not why:
        raise UsageError("--from and --case choose among flows", "--slowest 1, or --why")
    if why:
        unfit: dict[str, object] = {"direction": direction, "depth": depth, "limit": limit}
        unfit |= {"request": request, "response": response, "absolute": absolute or None}
        if refused := [name for name, value in unfit.items() if value is not None]:
            raise UsageError(f"--why goes without --{refused[0]}", "leave out one of them")
        if form is FlowFormat.HTML:
            raise UsageError("--why writes rows, no page", "--format table or json")
    elif by or detail:
        raise UsageError("--by and --detail are about rows; a flow is a tree", "add --why")
    elif wide:
        raise UsageError("--wide shows all columns of a table; a flow is a tree", "--why --wide")
    if slowest is not None and slowest > 1 and why:
        raise UsageError(
            f"--why is about one flow — --slowest {slowest}",
            f"msgflow query critical-path --slowest {slowest}",
        )
    if slowest is not None and slowest > 1 and form in (FlowFormat.JSON, FlowFormat.HTML):
        raise UsageError(f"a file has one flow — --slowest {slowest}", "--slowest 1, or a tree")
    with Database(database) as opened:
        starts: dict[str, Any] = {
            "place": place,
            "at": at,
            "publication_id": publication,
            "take_id": take,
            "callback_instance_id": callback_instance,
            "request_id": request,
            "response_id": response,
        }
        found, rows = [starts | {"run": run}], []
        if slowest is not None:
            if named := [name for name, value in starts.items() if value is not None]:
                raise UsageError(
                    f"--slowest chooses the message itself — {named[0]}", "leave out one of them"
                )
            choice: dict[str, Any] = {"from_": one_text(from_), "to": one_text(to)}
            choice |= {} if case is None else {"case": case}
            listed = opened.query("flows", run=run, internal=internal, slowest=slowest, **choice)
            rows = [row for row in listed.to_arrow().to_pylist() if row["take_id"] is not None]
            if not rows:
                raise UsageError(
                    "no flow arrived at the end of a path",
                    "msgflow query e2e-latency lists the paths",
                )
            ends = dict.fromkeys(row["take_id"] for row in rows)
            found = [{"take_id": number} for number in ends]
        if why:
            ids = ("request_id", "response_id")
            start = {name: value for name, value in found[0].items() if name not in ids}
            counted = case or ("every_pair" if slowest is None else "first")
            begin = one_text(from_) if slowest is None else None
            words = {"from_": begin, "by": by, "detail": detail}
            chosen: dict[str, Any] = {name: value for name, value in words.items() if value}
            result = opened.flow_why(**start, case=counted, internal=internal, **chosen)
            shown = None if form is None else Format(form.value)
            print_result(result, shown, output, wide=wide)
            return
        if slowest is not None and direction is None:
            direction = "backward"
        given = {"direction": direction, "depth": depth, "limit": limit}
        asked: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
        flows = [opened.flow(**start, internal=internal, **asked) for start in found]
        if form is FlowFormat.HTML and output is not None:
            size = opened.flow_page(flows[0], output)
            print_runs([flows[0].run])
            print_status(f"{size:,} bytes written to {output}: open it in a browser")
            return
    print_runs([flows[0].run])
    if form is FlowFormat.JSON:
        print_text(flows[0].to_json(), output)
    else:
        from msgflow.export.flow import tree_text

        print_drawing(
            lambda width, color: "\n\n".join(
                tree_text(flow, is_absolute=absolute, width=width, color=color) for flow in flows
            ),
            output,
        )
    for rank, row in enumerate(rows, start=1):
        print_note(
            f"slowest flow {rank}: {format_duration(row['latency_ns'])} to take {row['take_id']},"
            f" {row['path']}"
        )
    for note in dict.fromkeys(note for flow in flows for note in flow.notes):
        print_note(note)
