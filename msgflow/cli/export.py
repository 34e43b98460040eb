"""`msgflow export`: the content of a database as files."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msgflow.cli.completion import complete
from msgflow.cli.options import (
    OUTPUT,
    SELECTION,
    DatabaseOption,
    MemoryLimitOption,
    output_option,
)
from msgflow.cli.slice_options import with_slice
from msgflow.default_files import DEFAULT_DATABASE
from msgflow.errors import UsageError
from msgflow.export.series import What
from msgflow.query.times import Times
from msgflow.run.slice import ALL_RUNS, LATEST, Slice

if TYPE_CHECKING:
    from collections.abc import Sequence

    from msgflow.export.views import ExportedView

app = typer.Typer()

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
    from msgflow.cli.output import count, print_runs, print_status
    from msgflow.database import Database

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


@app.command("series")
@with_slice()
def series(
    output: Annotated[
        Path, output_option(help="FILE.csv or FILE.parquet, to write or replace")
    ] = Path("msgflow-series.csv"),
    what: Annotated[
        What,
        typer.Option(
            "--what",
            help="Latency of paths, duration of callbacks, or time from publication to take of"
            " topics",
            rich_help_panel=SELECTION,
        ),
    ] = What.PATHS,
    part: Slice = LATEST,
    times: Annotated[
        Times,
        typer.Option(
            "--times",
            help="First column: seconds since the start of the run (relative), seconds or ns since"
            " the epoch, or UTC as text (iso); with all but ns, values are in seconds",
            rich_help_panel=OUTPUT,
        ),
    ] = Times.RELATIVE,
    memory_limit: MemoryLimitOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write measured values side by side: one row per moment, one column per path.

    PlotJuggler and spreadsheets draw such files: the first column is the time.
    """
    from msgflow.cli.output import print_result
    from msgflow.database import Database
    from msgflow.export.formats import Format, format_of

    form = format_of(output)
    if form not in (Format.CSV, Format.PARQUET):
        raise UsageError(f"series are written as CSV or Parquet — {output}", "FILE.csv")
    with Database(database, memory_limit=memory_limit) as opened:
        result = opened.series(what, **asdict(part))
    print_result(result.with_times(times), form, output)


def _report(exported: Sequence[ExportedView], directory: Path) -> None:
    from msgflow.cli.output import count, print_status

    rows = sum(view.row_count for view in exported)
    print_status(f"{count(len(exported), 'view')}, {count(rows, 'row')} written to {directory}")
