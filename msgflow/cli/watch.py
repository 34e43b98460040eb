"""`msgflow watch`: a system seen while it runs, window by window."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msgflow.cli.options import OUTPUT, LinksOption, path_of

if TYPE_CHECKING:
    from msgflow.watch import WindowReport


def command(
    directory: Annotated[
        Path,
        typer.Argument(
            metavar="DIR", help="Directory of a rotated LTTng recording, or above several"
        ),
    ],
    window: Annotated[
        str, typer.Option("--window", metavar="TIME", help="Length of a window")
    ] = "10s",
    step: Annotated[
        str, typer.Option("--step", metavar="TIME", help="How far a window is from the one before")
    ] = "2s",
    links: LinksOption = None,
    clock_sync: Annotated[
        str,
        typer.Option(
            "--clock-sync",
            metavar="none|messages|FILE",
            help="How the clocks of several hosts are brought together",
        ),
    ] = "none",
    once: Annotated[
        bool,
        typer.Option("--once", help="Read a finished recording from its first to its last chunk"),
    ] = False,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="Print one JSON object per window", rich_help_panel=OUTPUT),
    ] = False,
) -> None:
    """See a ROS 2 system while it runs: latency of every path, window by window.

    The recording has to be rotated by LTTng (`lttng enable-rotation --timer 2s`).
    """
    from msgflow.cli.output import print_lines, print_note
    from msgflow.cli.show.window_line import window_line
    from msgflow.clocks import read_clock_sync
    from msgflow.links import read_links
    from msgflow.run.window import duration_ns
    from msgflow.watch import Watcher, watch_finished

    watcher = Watcher(
        window_ns=duration_ns(window, "--window"),
        step_ns=duration_ns(step, "--step"),
        links=None if links is None else read_links(links),
        clocks=read_clock_sync(clock_sync),
        note=print_note,
    )

    def show(report: WindowReport) -> None:
        print_lines([report.to_json() if as_json else window_line(report)])

    for report in watch_finished(path_of(directory).absolute(), watcher):
        show(report)
