"""Options that mean the same on every command that has them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.completion import complete
from msgflow.export.formats import Format
from msgflow.query.times import Times

SELECTION = "Which part of the data"
OUTPUT = "Output"


def path_of(text: str | Path) -> Path:
    """Return the path of an option; no shell replaces the `~` of `--db=~/x`."""
    return Path(os.path.expanduser(text))


DatabaseOption = Annotated[
    Path,
    typer.Option("--db", envvar="MSGFLOW_DB", metavar="FILE", parser=path_of, help="Database file"),
]
MemoryLimitOption = Annotated[
    str | None,
    typer.Option(
        "--memory-limit",
        envvar="MSGFLOW_MEMORY_LIMIT",
        metavar="SIZE",
        help="Maximum memory for the database, such as 2GB; what does not fit goes to disk",
        show_default="four fifths of the machine",
    ),
]
RunOption = Annotated[
    str | None,
    typer.Option(
        "--run",
        metavar="NAME|ID|all",
        help="Run to read",
        autocompletion=complete("run", "all"),
        show_default="the latest",
        rich_help_panel=SELECTION,
    ),
]
InternalOption = Annotated[
    bool,
    typer.Option(
        "--internal",
        help="Also show what ROS does for itself (/rosout, /parameter_events, …)",
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
WideOption = Annotated[
    bool,
    typer.Option(
        "--wide",
        help="On a terminal, show all columns and rows, however wide",
        rich_help_panel=OUTPUT,
    ),
]
ColumnsOption = Annotated[
    str | None,
    typer.Option(
        "--columns",
        metavar="A,B,…",
        help="Only these columns, in this order",
        show_default="all; on a terminal, those that fit and are not empty",
        rich_help_panel=OUTPUT,
    ),
]
OutputOption = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="FILE",
        parser=path_of,
        help="File to write or replace",
        show_default="stdout",
        rich_help_panel=OUTPUT,
    ),
]
LakeOption = Annotated[
    str,
    typer.Option(
        "--lake",
        envvar="MSGFLOW_LAKE",
        metavar="PATH|s3://BUCKET/PREFIX",
        parser=os.path.expanduser,
        help="The lake: a folder or a bucket",
    ),
]
LakeWhereOption = Annotated[
    str | None,
    typer.Option(
        "--where",
        metavar="CONDITION",
        help="Runs for which this is true: SQL on labels and columns of run, such as"
        " \"robot = 'r1'\"",
        show_default="all runs",
        rich_help_panel=SELECTION,
    ),
]
# MSGFLOW_LAKE does not count here: these commands are of a database first.
LakePageOption = Annotated[
    str | None,
    typer.Option(
        "--lake",
        metavar="PATH|s3://BUCKET/PREFIX",
        parser=os.path.expanduser,
        help="A lake, in place of a database: paths of its runs by label over time",
    ),
]
