"""The program `msgflow`: its commands by name, imported without the database stack."""

from __future__ import annotations

from typing import Annotated

import typer

# Scripts of an editable installation look for it here.
from msgflow.__main__ import main
from msgflow.cli import (
    check,
    clocks,
    compare,
    db,
    events,
    export,
    flow,
    graph,
    info,
    ingest,
    links,
    paths,
    query,
    report,
    runs,
    simulate,
    sql,
    targets,
    ui,
    verify,
)
from msgflow.cli.root import RootGroup
from msgflow.version import __version__

__all__ = ["app", "main"]

app = typer.Typer(
    name="msgflow",
    cls=RootGroup,
    help="ROS 2 traces as a relational database: where every message went, what it caused, and"
    " where the time was lost.",
    epilog="Begin with: msgflow ingest TRACE, then: msgflow query e2e-latency",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("ingest")(ingest.command)
app.add_typer(query.app, name="query")
app.command("flow")(flow.command)
app.command("graph")(graph.command)
app.command("ui")(ui.command)
app.command("report")(report.command)
app.command("compare")(compare.command)
app.command("verify")(verify.command)
app.add_typer(targets.app, name="targets")
app.command("events")(events.command)
app.command("sql")(sql.command)
app.command("info")(info.command)
app.command("check")(check.command)
app.add_typer(runs.app, name="runs")
app.add_typer(links.app, name="links")
app.add_typer(paths.app, name="paths")
app.add_typer(clocks.app, name="clocks")
app.add_typer(export.app, name="export")
app.add_typer(db.app, name="db")
app.command("simulate")(simulate.command)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"msgflow {__version__}")
        raise typer.Exit()


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version"),
    ] = False,
) -> None:
    """Print the help where no command is given."""
    if context.invoked_subcommand is None:
        context.get_help()
