"""Options that mean the same on every command that has them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msgflow.export.formats import Format
from msgflow.query.times import Times

DEFAULT_DATABASE = Path("msgflow.duckdb")

SELECTION = "Which part of the data"
OUTPUT = "Output"

DatabaseOption = Annotated[
    Path,
    typer.Option("--db", envvar="MSGFLOW_DB", metavar="FILE", help="Database file"),
]
RunOption = Annotated[
    str | None,
    typer.Option(
        "--run",
        metavar="NAME|ID|all",
        help="Run to read",
        show_default="the latest",
        rich_help_panel=SELECTION,
    ),
]
StartOption = Annotated[
    str | None,
    typer.Option(
        "--start",
        metavar="TIME",
        help="Begin of the time window: 2.5s from the start of the run, epoch ns, or ISO time",
        rich_help_panel=SELECTION,
    ),
]
EndOption = Annotated[
    str | None,
    typer.Option(
        "--end",
        metavar="TIME",
        help="End of the time window, written likewise",
        rich_help_panel=SELECTION,
    ),
]
SkipFirstOption = Annotated[
    float | None,
    typer.Option(
        "--skip-first",
        metavar="SECONDS",
        min=0,
        help="Leave out the begin of the run, where the system warms up",
        rich_help_panel=SELECTION,
    ),
]
InternalOption = Annotated[
    bool,
    typer.Option(
        "--internal",
        help="Show what ROS does for itself too (/rosout, /parameter_events, …)",
        rich_help_panel=SELECTION,
    ),
]
FormatOption = Annotated[
    Format | None,
    typer.Option(
        "--format",
        metavar="FORMAT",
        help=", ".join(Format),
        show_default="by the suffix of FILE, else table",
        rich_help_panel=OUTPUT,
    ),
]
TimesOption = Annotated[
    Times | None,
    typer.Option(
        "--times",
        help="Points in time: ns since the epoch, seconds since it, seconds since the start of the"
        " run (relative), or UTC as text (iso); with all but ns, durations are in seconds",
        show_default="ns; tables have units",
        rich_help_panel=OUTPUT,
    ),
]
OutputOption = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="FILE",
        help="File to write or replace",
        show_default="stdout",
        rich_help_panel=OUTPUT,
    ),
]
