"""Write the content of a database to files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from msgflow.cli.operation import asks
from msgflow.cli.output import print_note, print_runs, print_status
from msgflow.database import Database
from msgflow.text.values import count

if TYPE_CHECKING:
    from msgflow.export.folded import FoldedStacks
    from msgflow.export.mcap import ExportedMcap
    from msgflow.export.otlp import ExportedTraces
    from msgflow.export.perfetto import PerfettoTrace
    from msgflow.export.timing_model import TimingModel
    from msgflow.export.view_files import ExportedView

app = typer.Typer()

# What answers most questions without a join.
_FIRST = {"callback_run", "message"}


@app.command("parquet")
@asks(Database.export_parquet)
def parquet(exported: Sequence[ExportedView], output: Path) -> None:
    """pandas, polars, pyarrow and DuckDB read them."""
    _report(exported, output)


@app.command("csv")
@asks(Database.export_csv)
def csv(exported: Sequence[ExportedView], output: Path) -> None:
    """Spreadsheets read them."""
    _report(exported, output)


@app.command("perfetto")
@asks(Database.export_perfetto)
def perfetto(trace: PerfettoTrace, output: Path) -> None:
    """It needs the package perfetto: pip install perfetto, or in a checkout '.[perfetto]'."""
    print_runs([trace.run])
    own = f", {count(trace.events, 'event')} of your own" if trace.events else ""
    own += f", {count(trace.states, 'state')} of threads and cores" if trace.states else ""
    own += f", {count(trace.samples, 'sample')} of stacks" if trace.samples else ""
    print_status(
        f"{count(trace.slices, 'slice')}, {count(trace.arrows, 'arrow')},"
        f" {count(trace.values, 'value')} of counters{own} written to {output}:"
        " open it at ui.perfetto.dev"
    )


@app.command("folded")
@asks(Database.export_folded)
def folded(stacks: FoldedStacks, output: Path) -> None:
    """speedscope.app opens the file, and so does flamegraph.pl."""
    print_runs([stacks.run])
    print_status(
        f"{count(stacks.stacks, 'stack')} of {count(stacks.samples, 'sample')} written to {output}"
    )


@app.command("timing-model")
@asks(Database.export_timing_model)
def timing_model(model: TimingModel, output: Path) -> None:
    """docs/export.md says what the bound is."""
    print_runs([model.run])
    print_status(
        f"{count(model.callbacks, 'callback')}, {count(model.chains, 'chain')} written to {output}"
    )
    if model.exceeded:
        print_note(
            f"{count(model.exceeded, 'callback')} took longer than the bound: their executors had"
            " no CPU, or do not decide what is ready when a wait ends"
        )


@app.command("mcap")
@asks(Database.export_mcap)
def mcap(written: ExportedMcap, output: Path, targets: Path | None) -> None:
    """It needs the package mcap-ros2-support: pip install it, or in a checkout '.[mcap]'."""
    print_runs([written.run])
    unmet = f", {count(written.violations, 'violation')}" if targets is not None else ""
    print_status(
        f"{count(written.values, 'value')} of {count(written.topics, 'topic')},"
        f" {count(written.losses, 'warning')}{unmet} written to {output}"
    )


@app.command("otlp")
@asks(Database.export_otlp)
def otlp(traces: ExportedTraces, output: Path) -> None:
    """Jaeger opens the file, and a collector sends it to others, see docs/export.md."""
    print_runs([traces.run])
    print_status(
        f"{count(traces.traces, 'trace')}, {count(traces.spans, 'span')},"
        f" {count(traces.links, 'link')} written to {output}"
    )


def _report(exported: Sequence[ExportedView], directory: Path) -> None:
    rows = sum(view.row_count for view in exported)
    print_status(f"{count(len(exported), 'view')}, {count(rows, 'row')} written to {directory}")
    names = {view.view for view in exported}
    if names > _FIRST:
        empty = sum(not view.row_count for view in exported)
        print_note(
            f"start with {', '.join(sorted(_FIRST))}: they have the names inside;"
            f" {count(empty, 'view')} without rows; msgflow db schema says what each is"
        )
