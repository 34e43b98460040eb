"""Options of several commands, and their types.

A function makes an option whose help differs from command to command.
"""

from __future__ import annotations

import os
import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from msgflow.cli.completion import complete
from msgflow.export.formats import Format
from msgflow.query.selection import CASES
from msgflow.result.times import Times

SELECTION = "Which part of the data"
OUTPUT = "Output"
_HELP = ("--help", "-h")
_SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*(?:([kKMGT]?)B)?")
_UNITS = {"": 1, "K": 1e3, "M": 1e6, "G": 1e9, "T": 1e12}


class DefaultGroup(TyperGroup):
    """A group with a default command: `msgflow runs` means `msgflow runs list`."""

    default = "list"

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the default command in front, unless a command or --help comes first."""
        if not args or (args[0].startswith("-") and args[0] not in _HELP):
            args = [self.default, *args]
        return super().parse_args(ctx, args)


def bytes_of(size: str) -> int:
    """Return the bytes of a size such as '20MB'; 0 where the text is no size."""
    match = _SIZE.fullmatch(size.strip())
    return round(float(match[1]) * _UNITS[(match[2] or "").upper()]) if match else 0


def path_of(text: str | Path) -> Path:
    """Return the path of an option; no shell replaces the `~` of `--db=~/x`."""
    return Path(os.path.expanduser(text))


class Reader(StrEnum):
    """Decoders of traces."""

    AUTO = "auto"
    MSGFLOW = "msgflow"
    BT2 = "bt2"


def memory_limit_option(
    help: str, default: str = "a quarter of the machine's, 500MB to 4GB"
) -> Any:
    """Return the option for the memory of the database."""
    return typer.Option(
        "--memory-limit",
        envvar="MSGFLOW_MEMORY_LIMIT",
        metavar="SIZE",
        help=help,
        show_default=default,
    )


def format_option(help: str, **more: Any) -> Any:
    """Return the option for the format of what is written."""
    return typer.Option("--format", help=help, rich_help_panel=OUTPUT, **more)


def case_option(help: str, **more: Any) -> Any:
    """Return the option for the arrivals of flows that count."""
    return typer.Option(
        "--case",
        metavar="|".join(CASES),
        help=f"{help}: first or last arrival of each root, newest root of each arrival, or all",
        show_default=CASES[0],
        autocompletion=lambda: list(CASES),
        **more,
    )


def output_option(
    metavar: str = "FILE", help: str = "File to write or replace", **more: Any
) -> Any:
    """Return the option for the file to write."""
    return typer.Option(
        "-o",
        "--output",
        metavar=metavar,
        parser=path_of,
        help=help,
        rich_help_panel=OUTPUT,
        **more,
    )


DatabaseOption = Annotated[
    Path,
    typer.Option("--db", envvar="MSGFLOW_DB", metavar="FILE", parser=path_of, help="Database file"),
]
MemoryLimitOption = Annotated[
    str | None,
    memory_limit_option(
        "Memory of the database, such as 2GB",
        "four fifths of the machine",
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
    format_option(
        ", ".join(Format), metavar="FORMAT", show_default="by the suffix of FILE, else table"
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
        help="Show all columns and rows of a table, however wide",
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
OutputOption = Annotated[Path | None, output_option(show_default="stdout")]
LinksOption = Annotated[
    Path | None,
    typer.Option(
        "--links", metavar="FILE", parser=path_of, help="Indirect links to declare, as YAML"
    ),
]
ClockSyncOption = Annotated[
    str,
    typer.Option(
        "--clock-sync",
        metavar="none|messages|FILE",
        parser=os.path.expanduser,
        help="Synchronise the clocks of several hosts: by their messages (and the network"
        " packets of kernel traces), or by offsets in a file",
    ),
]
PathsOption = Annotated[
    Path,
    typer.Option(
        "--paths",
        metavar="FILE",
        parser=path_of,
        help="The file with the paths that have names",
    ),
]


def targets_option(effect: str) -> Any:
    """Return the option `--targets`, a file of requirements; `effect` says what they change."""
    return typer.Option(
        "--targets", metavar="FILE", parser=path_of, help=f"Requirements, as YAML: {effect}"
    )


OwnEventsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--events",
        metavar="PATTERN",
        help="Also your own tracepoints, such as 'my_pkg:*'; repeatable",
    ),
]
ReaderOption = Annotated[Reader, typer.Option("--reader", help="Decoder of the traces")]
LakeOption = Annotated[
    str,
    typer.Option(
        "--lake",
        envvar="MSGFLOW_LAKE",
        metavar="PATH",
        parser=os.path.expanduser,
        help="The lake: a folder, or s3://BUCKET/PREFIX",
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
# Not from MSGFLOW_LAKE: without this option these commands read a database.
LakePageOption = Annotated[
    str | None,
    typer.Option(
        "--lake",
        metavar="PATH",
        parser=os.path.expanduser,
        help="A lake (a folder, or s3://BUCKET/PREFIX), in place of a database: paths by label"
        " over time",
    ),
]
