"""`msgflow targets`: files of requirements, for `msgflow verify`."""

from __future__ import annotations

from typing import Annotated

import typer

from msgflow.cli.options import DatabaseOption, OutputOption
from msgflow.cli.slice_options import with_slice
from msgflow.default_files import DEFAULT_DATABASE
from msgflow.run.slice import LATEST, Slice

app = typer.Typer()


@app.command("suggest")
@with_slice("run", "skip_first")
def suggest(
    part: Slice = LATEST,
    margin: Annotated[
        float,
        typer.Option(
            "--margin", metavar="PERCENT", min=0, help="How much more than measured is allowed"
        ),
    ] = 20.0,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write requirements that a good run meets, as a file to review.

    It covers paths, timers, topics, services and actions with at least 20 values. A note and a
    comment in the file name topics of which less than 99 % was delivered.
    """
    from msgflow.cli.output import print_note, print_text
    from msgflow.database import Database

    with Database(database) as opened:
        text = opened.suggest_targets(run=part.run, skip_first=part.skip_first, margin=margin / 100)
    print_text(text, output)
    for line in text.splitlines()[1:]:
        if line.startswith("# "):
            print_note(line.removeprefix("# "))
