"""`msgflow export`: the content of a database as files."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msgflow.cli.completion import complete, complete_path
from msgflow.cli.options import (
    SELECTION,
    DatabaseOption,
    MemoryLimitOption,
    PathsOption,
    output_option,
    targets_option,
)
from msgflow.cli.slice_options import with_slice
from msgflow.files.default_files import DEFAULT_DATABASE, DEFAULT_PATHS
from msgflow.run.slice import ALL_RUNS, LATEST, Slice

if TYPE_CHECKING:
    from collections.abc import Sequence

    from msgflow.export.views import ExportedView

app = typer.Typer()

# What answers most questions without a join.
_FIRST = {"callback_run", "message"}

_DirectoryOption = Annotated[Path, output_option("DIR", "Directory, created if missing")]
_ViewsArgument = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="VIEW",
        help="Public views to export, see msgflow db schema (default: all)",
        autocompletion=complete("view"),
    ),
]
_RunOption = Annotated[
    str,
    typer.Option(
        "--run",
        metavar="NAME|ID|all",
        help="Run to export",
        autocompletion=complete("run", "all"),
        rich_help_panel=SELECTION,
    ),
]


def _place_option(name: str, help: str) -> Any:
    return typer.Option(
        name,
        metavar="NAME",
        help=help,
        autocompletion=complete("place"),
        rich_help_panel=SELECTION,
    )


_ForceOption = Annotated[bool, typer.Option("--force", help="Replace an earlier export")]


@app.command("parquet")
@with_slice(run=_RunOption)
def parquet(
    views: _ViewsArgument = None,
    directory: _DirectoryOption = Path("msgflow-parquet"),
    part: Slice = ALL_RUNS,
    force: _ForceOption = False,
    memory_limit: MemoryLimitOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write public views to DIR/VIEW/run_id=ID/data.parquet.

    If anything fails, nothing is written. The metadata of each file have the view,
    the schema revision and the version of msgflow.

    A time window selects what happened in it (links by their cause); objects are
    always written.
    """
    from msgflow.database import Database

    with Database(database, memory_limit=memory_limit) as opened:
        exported = opened.export_parquet(
            directory,
            views or (),
            **asdict(part),
            force=force,
        )
    _report(exported, directory)


@app.command("csv")
@with_slice(run=_RunOption)
def csv(
    views: _ViewsArgument = None,
    directory: _DirectoryOption = Path("msgflow-csv"),
    part: Slice = ALL_RUNS,
    force: _ForceOption = False,
    memory_limit: MemoryLimitOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write public views to DIR/VIEW.csv. If anything fails, nothing is written.

    Text is quoted; a missing value is an empty field without quotes.

    A time window selects what happened in it (links by their cause); objects are
    always written.
    """
    from msgflow.database import Database

    with Database(database, memory_limit=memory_limit) as opened:
        exported = opened.export_csv(
            directory,
            views or (),
            **asdict(part),
            force=force,
        )
    _report(exported, directory)


@app.command("perfetto")
@with_slice()
def perfetto(
    output: Annotated[Path, output_option()] = Path("msgflow.pftrace"),
    part: Slice = LATEST,
    memory_limit: MemoryLimitOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write a run as a trace for the Perfetto UI (ui.perfetto.dev, in the browser).

    Each thread is a track with its callbacks, publications, takes, requests and
    responses. Also: executor states, arrows for all links, gaps, events of your own
    tracepoints, and counters for rates and for messages not yet taken.

    Needs the package perfetto: pip install perfetto, or in a checkout '.\\[perfetto]'.
    """
    from msgflow.cli.output import print_runs, print_status
    from msgflow.database import Database
    from msgflow.text.values import count

    with Database(database, memory_limit=memory_limit) as opened:
        trace = opened.export_perfetto(output, **asdict(part))
    print_runs([trace.run])
    own = f", {count(trace.events, 'event')} of your own" if trace.events else ""
    own += f", {count(trace.states, 'state')} of threads and cores" if trace.states else ""
    print_status(
        f"{count(trace.slices, 'slice')}, {count(trace.arrows, 'arrow')},"
        f" {count(trace.values, 'value')} of counters{own} written to {output}:"
        " open it at ui.perfetto.dev"
    )


@app.command("mcap")
@with_slice()
def mcap(
    output: Annotated[Path, output_option("FILE.mcap")] = Path("msgflow.mcap"),
    targets: Annotated[Path | None, targets_option("those that are not met get a message")] = None,
    paths: PathsOption = Path(DEFAULT_PATHS),
    part: Slice = LATEST,
    memory_limit: MemoryLimitOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write measured values of a run for Foxglove, Lichtblick, PlotJuggler and Rerun.

    They show them beside the bag of the same drive. Topics below /msgflow have
    latency and age of paths, latency of topics, and duration and waits of
    callbacks, in milliseconds. /msgflow/log has a warning for each message that
    was dropped or lost.

    Needs the package mcap-ros2-support: pip install mcap-ros2-support, or in a
    checkout '.\\[mcap]'.
    """
    from msgflow.cli.output import print_runs, print_status
    from msgflow.database import Database
    from msgflow.text.values import count

    with Database(database, memory_limit=memory_limit) as opened:
        written = opened.export_mcap(output, **asdict(part), targets=targets, paths=paths)
    print_runs([written.run])
    unmet = f", {count(written.violations, 'violation')}" if targets is not None else ""
    print_status(
        f"{count(written.values, 'value')} of {count(written.topics, 'topic')},"
        f" {count(written.losses, 'warning')}{unmet} written to {output}"
    )


@app.command("otlp")
@with_slice()
def otlp(
    output: Annotated[Path, output_option("FILE.json")] = Path("msgflow-traces.json"),
    from_: Annotated[
        list[str] | None,
        _place_option("--from", "Flows that start at this topic or node"),
    ] = None,
    to: Annotated[
        list[str] | None,
        _place_option("--to", "Flows that end at this topic or node"),
    ] = None,
    via: Annotated[
        list[str] | None,
        _place_option("--via", "Flows through all of these topics and nodes"),
    ] = None,
    without: Annotated[
        list[str] | None,
        _place_option("--without", "Flows through none of these"),
    ] = None,
    slowest: Annotated[
        int | None,
        typer.Option(
            "--slowest",
            metavar="N",
            min=1,
            help="Only the N slowest flows",
            rich_help_panel=SELECTION,
        ),
    ] = None,
    path: Annotated[
        str | None,
        typer.Option(
            "--path",
            metavar="NAME",
            help="A path by its name in a file, see msgflow suggest paths",
            autocompletion=complete_path,
            rich_help_panel=SELECTION,
        ),
    ] = None,
    paths: PathsOption = Path(DEFAULT_PATHS),
    part: Slice = LATEST,
    memory_limit: MemoryLimitOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write a run as traces of OpenTelemetry, for Jaeger, Grafana Tempo and others.

    A trace is a root and all that it led to: callbacks, publications, takes,
    requests and responses are spans, and further causes are links. If flows are
    chosen, a trace is a flow that reached the end of its path.

    The file is OTLP/JSON, a request per line: Jaeger opens it, and a collector sends
    it to others, see docs/export.md.
    """
    from msgflow.cli.output import print_runs, print_status
    from msgflow.database import Database
    from msgflow.text.values import count

    places = {"from_": from_, "to": to, "via": via, "without": without}
    given: dict[str, Any] = {name: ",".join(names) for name, names in places.items() if names}
    with Database(database, memory_limit=memory_limit) as opened:
        traces = opened.export_otlp(
            output,
            **asdict(part),
            **given,
            slowest=slowest,
            path=path,
            paths=paths,
        )
    print_runs([traces.run])
    print_status(
        f"{count(traces.traces, 'trace')}, {count(traces.spans, 'span')},"
        f" {count(traces.links, 'link')} written to {output}"
    )


def _report(exported: Sequence[ExportedView], directory: Path) -> None:
    from msgflow.cli.output import print_note, print_status
    from msgflow.text.values import count

    rows = sum(view.row_count for view in exported)
    print_status(f"{count(len(exported), 'view')}, {count(rows, 'row')} written to {directory}")
    names = {view.view for view in exported}
    if names > _FIRST:
        empty = sum(not view.row_count for view in exported)
        print_note(
            f"start with {', '.join(sorted(_FIRST))}: they have the names inside;"
            f" {count(empty, 'view')} without rows; msgflow db schema says what each is"
        )
