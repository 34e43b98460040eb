"""What several commands take: options and arguments, by the name of their parameter."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Any, Literal

import typer
from typer.core import TyperGroup

from msgflow.cli.completion import complete, complete_path
from msgflow.errors import UsageError
from msgflow.export.formats import Format
from msgflow.query.selection import CASES, KINDS

SELECTION = "Which part of the data"
OUTPUT = "Output"
ADVANCED = "Advanced"
ADVANCED_NAMES = frozenset(
    ("case", "from_event", "to_event", "max_depth", "max_paths", "confidence", "resamples", "seed")
)
"""Options that few need: their panel is the last one of a help."""
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


def bytes_of(size: str, example: str, most: float = math.inf) -> int:
    """Return the bytes of a size such as '20MB'."""
    match = _SIZE.fullmatch(size.strip())
    number = round(float(match[1]) * _UNITS[(match[2] or "").upper()]) if match else 0
    if not 0 < number <= most:
        raise UsageError(f"cannot read the size — {size}", example)
    return number


def one_text(given: Any) -> Any:
    """Return what an option was given: once, it is a text, in which commas may part names."""
    return given[0] if isinstance(given, list) and len(given) == 1 else given


def path_of(text: str | Path) -> Path:
    """Return the path of an option; no shell replaces the `~` of `--db=~/x`."""
    return Path(os.path.expanduser(text))


Reader = Literal["auto", "msgflow", "bt2"]
"""Decoders of traces."""


def _selecting(help: str, metavar: str | None = None, **more: Any) -> Any:
    return typer.Option(help=help, metavar=metavar, rich_help_panel=SELECTION, **more)


def _place(help: str) -> Any:
    return _selecting(help, "NAME", autocompletion=complete("place"))


def _printed(*names: str, help: str, **more: Any) -> Any:
    return typer.Option(*names, help=help, rich_help_panel=OUTPUT, **more)


def _words(*words: str) -> Any:
    """Return an option with one of a few words: `Database` refuses others."""
    return typer.Option(
        metavar="WORD", autocompletion=lambda: list(words), rich_help_panel=SELECTION
    )


_RUN = complete("run")

SHARED: dict[str, Any] = {
    "database": typer.Option("--db", envvar="MSGFLOW_DB", help="Database file"),
    "memory_limit": typer.Option(
        envvar="MSGFLOW_MEMORY_LIMIT", metavar="SIZE", help="Memory of the database, such as 2GB"
    ),
    "run": _selecting(
        "Run to read",
        "NAME|ID|all",
        autocompletion=complete("run", "all"),
        show_default="the latest",
    ),
    "start": _selecting(
        "Start of the time window: seconds from the start of the run, 100ms, ISO time, epoch ns"
        " (16 digits or more), or sim:12.5 (seconds of a simulation)",
        "TIME",
    ),
    "end": _selecting("End of the time window, in the same formats as --start", "TIME"),
    "internal": _selecting("Also show what ROS does for itself (/rosout, /parameter_events, …)"),
    "at": typer.Option(metavar="TIME"),
    "place": typer.Argument(metavar="[TOPIC|NODE]", autocompletion=complete("place")),
    "changes": typer.Option("--set", metavar="CHANGE"),
    "from_": _place("Topics or nodes where flows start"),
    "to": _place("Topics or nodes where flows end"),
    "via": _place("Flows through all of these topics and nodes"),
    "without": _place("Flows through none of these"),
    "case": _words(*CASES),
    **{
        kind: _selecting("A name, or a glob", "NAME", autocompletion=complete(kind))
        for kind in KINDS
    },
    "sort": _selecting("Column to sort by, or several", "COLUMN[:desc]"),
    "limit": _selecting("Maximum number of rows", "N", min=1),
    "slowest": _selecting("Only the N slowest flows", "N", min=1),
    "path": _selecting(
        "A path by its number, or its name in a file (msgflow suggest paths)",
        "NAME",
        autocompletion=complete_path,
    ),
    "paths": typer.Option(help="The file with the paths that have names"),
    "compare": _selecting("Run to compare it with", "NAME|ID", autocompletion=_RUN),
    "run_a": typer.Argument(metavar="RUN_A", autocompletion=_RUN),
    "run_b": typer.Argument(metavar="RUN_B", autocompletion=_RUN),
    "what": _words("paths", "ends", "callbacks", "topics"),
    "views": typer.Argument(metavar="VIEW", autocompletion=complete("view")),
    "form": _printed(
        "--format",
        help=", ".join(Format),
        metavar="FORMAT",
        show_default="by the suffix of FILE, else table",
    ),
    "output": _printed("-o", "--output", help="File to write or replace", show_default="stdout"),
    "columns": _printed(
        help="Only these columns, in this order",
        metavar="A,B,…",
        show_default="all; on a terminal, those that fit and are not empty",
    ),
    "wide": _printed(help="Show all columns and rows of a table, however wide"),
    "times": _printed(
        help="Points in time: ns since the epoch, seconds since it, seconds since the start of the"
        " run (relative) or of a simulation (sim), or UTC as text (iso); with all but ns,"
        " durations are in seconds",
        show_default="ns; tables have units",
    ),
    "links": typer.Option(help="Indirect links to declare, as YAML"),
    "clock_sync": typer.Option(
        metavar="messages|FILE",
        parser=os.path.expanduser,
        help="Synchronise the clocks of several hosts: by their messages (and the network"
        " packets of kernel traces), or by offsets in a file",
    ),
    "events": typer.Option(
        metavar="PATTERN", help="Also your own tracepoints, such as 'my_pkg:*'; repeatable"
    ),
    "ignore": typer.Option(
        metavar="PATTERN", help="Skip events with these names, such as 'dds:*'; repeatable"
    ),
    "reader": typer.Option(help="Decoder of the traces"),
    "strict": typer.Option(help="Refuse damaged traces instead of keeping what can be read"),
    "quiet": typer.Option("--quiet", "-q", help="Print only errors and lost work"),
    "lake": typer.Option(
        envvar="MSGFLOW_LAKE",
        metavar="PATH",
        parser=os.path.expanduser,
        help="The lake: a folder, or s3://BUCKET/PREFIX",
    ),
    "where": _selecting(
        "Runs for which this is true: SQL on labels and columns of run, such as \"robot = 'r1'\"",
        "CONDITION",
    ),
}
"""What Typer should know of a parameter; the function says its type and its default."""
