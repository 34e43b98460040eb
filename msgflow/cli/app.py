"""The program `msgflow`: its commands are imported when they are asked for."""

from __future__ import annotations

from typing import Annotated

import typer

from msgflow.cli.root import RootGroup
from msgflow.version import __version__

app = typer.Typer(
    name="msgflow",
    cls=RootGroup,
    help="ROS 2 traces as a relational database: where every message went, what it caused, and"
    " where the time was lost.",
    epilog="Begin with: msgflow ingest TRACE, then: msgflow query e2e-latency",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


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
