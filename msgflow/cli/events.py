"""List the events of any CTF traces in order of time."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msgflow.cli.operation import operation
from msgflow.cli.options import Reader
from msgflow.cli.output import data_stream, print_note, print_result, print_status
from msgflow.errors import UsageError
from msgflow.events.formats import TABLES, EventFormat, format_of, is_directory
from msgflow.export.formats import Format
from msgflow.text.values import count as counted

if TYPE_CHECKING:
    from msgflow.events.selection import Selection


_DAMAGES_SHOWN = 10


@operation
def command(
    traces: list[Path],
    *,
    event: Annotated[list[str] | None, typer.Option("--event", "-e")] = None,
    start: str | None = None,
    end: str | None = None,
    count: bool = False,
    form: EventFormat | None = None,
    output: Path | None = None,
    reader: Reader = "auto",
    strict: bool = False,
) -> None:
    """A line has the time (UTC), host, process name/vpid/vtid, CPU, event name and fields.

    Args:
        traces (TRACE...): Directories with CTF traces, at any depth, or archives of such; all are
            merged.
        event (PATTERN): Name of events to list, such as 'ros2:rcl_*'; may be repeated.
        start: Start of the listing: 2.5s from the start of the trace, epoch ns, or ISO time.
        end: End of the listing, in the same formats as --start.
        count: Print only how often each event occurs.
        form (text|json|jsonl|csv|parquet): By default by the suffix of PATH, else text; parquet for
            a directory.
        output (PATH): File to write or replace; or, for CSV and Parquet, a new directory (a name
            without suffix) that gets one file per event name, with a column per field.
    """
    from msgflow import trace
    from msgflow.events.selection import Selection

    with trace.open(traces, reader=reader, strict=strict) as opened:
        selection = Selection(opened, event or (), start, end)
        if count:
            _print_counts(selection, form, output)
        else:
            _write(selection, form or format_of(output), output)
        lost = selection.lost_event_count
        damages = list(opened.damages)
        copies = opened.duplicate_packet_count + sum(opened.repeated_packet_counts.values())
    for damage in damages[:_DAMAGES_SHOWN]:
        place = f"packet {damage.position}, byte {damage.offset}"
        print_note(f"{damage.message} — {damage.file}, {place}")
    if len(damages) > _DAMAGES_SHOWN:
        print_note(counted(len(damages) - _DAMAGES_SHOWN, "further damage"))
    if copies:
        print_note(f"{counted(copies, 'packet')} left out: the traces hold the same once more")
    if lost:
        print_note(f"{counted(lost, 'event')} lost by the tracer while recording")


def _write(selection: Selection, form: EventFormat, output: Path | None) -> None:
    from msgflow.cli.progress import ingest_progress
    from msgflow.events.listing import write_events
    from msgflow.events.tables import write_event_tables
    from msgflow.files.atomic import replacing

    if output is None:
        if form is EventFormat.PARQUET and sys.stdout.isatty():
            raise UsageError("Parquet is not for a terminal", "name a file with -o FILE.parquet")
        if not write_events(selection, form, data_stream()):
            print_note("no events")
        return
    with ingest_progress(quiet=False) as progress:
        if is_directory(output) and (form in TABLES or output.is_dir()):
            if form not in TABLES:
                raise UsageError(
                    f"this is a directory, which only CSV and Parquet can fill — {output}",
                    f"name a file: -o {output / f'events.{form}'}",
                )
            number = write_event_tables(selection, form, output, progress)
        else:
            with replacing(output) as temporary, temporary.open("wb") as stream:
                number = write_events(selection, form, stream, progress)
    print_status(f"{counted(number, 'event')} written to {output}")


def _print_counts(selection: Selection, form: EventFormat | None, output: Path | None) -> None:
    import pyarrow

    from msgflow.result.query_result import QueryResult

    counts = selection.counts()
    columns = {"name": [*counts], "event_count": [*counts.values()]}
    schema = pyarrow.schema({"name": "string", "event_count": "int64"})
    chosen = None if form is None else Format("table" if form is EventFormat.TEXT else form.value)
    print_result(QueryResult(pyarrow.table(columns, schema)), chosen, output)
