"""`msgflow runs`: the runs of a database."""

from __future__ import annotations

from typing import Annotated

import typer

from msgflow.cli.completion import complete
from msgflow.cli.options import (
    DEFAULT_DATABASE,
    DatabaseOption,
    FormatOption,
    OutputOption,
    WideOption,
)

app = typer.Typer(help="List, rename and remove runs.")
_RunArgument = Annotated[
    str,
    typer.Argument(metavar="RUN", help="Name or id of the run", autocompletion=complete("run")),
]


@app.callback()
def group() -> None:
    """List, rename and remove runs."""


@app.command("list")
def list_runs(
    form: FormatOption = None,
    output: OutputOption = None,
    wide: WideOption = False,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """List the runs of a database: the query info-runs."""
    from dataclasses import replace

    from msgflow.cli.output import print_result
    from msgflow.database import Database

    with Database(database) as opened:
        result = opened.query("info-runs", run="all")
    # They are what is listed.
    print_result(replace(result, runs=()), form, output, wide=wide)


@app.command("rename")
def rename(
    run: _RunArgument,
    name: Annotated[str, typer.Argument(metavar="NAME", help="Its new name")],
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Give a run another name."""
    from msgflow.cli.output import print_status
    from msgflow.database import Database

    with Database(database) as opened:
        before = opened.rename_run(run, name)
    print_status(f"run {before.run_id} renamed: {before.name} is {name}")


@app.command("remove")
def remove(
    run: Annotated[
        str,
        typer.Argument(
            metavar="RUN|all",
            help="Name or id of the run, or all",
            autocompletion=complete("run", "all"),
        ),
    ],
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Remove a run with all that is known of it; what other runs have stays as it is.

    The file keeps its size, and the next ingest uses the space again.
    """
    from msgflow.cli.output import print_status
    from msgflow.database import Database

    with Database(database) as opened:
        for one in opened.remove_runs(run):
            print_status(f"run {one.run_id} removed: {one.name}")
