"""List, rename, label and remove runs; without a command: list."""

from __future__ import annotations

import shlex
from dataclasses import replace
from typing import Annotated

import typer

from msgflow.backports import Unpack
from msgflow.cli.completion import complete
from msgflow.cli.operation import operation
from msgflow.cli.options import DefaultGroup
from msgflow.cli.output import Shown, confirm, print_result, print_status
from msgflow.database import Database
from msgflow.errors import ExitCode, UsageError
from msgflow.run.choice import choose_runs

app = typer.Typer(cls=DefaultGroup)
_Run = Annotated[str, typer.Argument(metavar="RUN", autocompletion=complete("run"))]
_Runs = Annotated[str, typer.Argument(metavar="RUN|all", autocompletion=complete("run", "all"))]


@app.command("list")
@operation
def list_runs(database: Database, **shown: Unpack[Shown]) -> None:
    """List the runs of a database."""
    # The rows name the runs already.
    print_result(replace(database.query("info", run="all"), runs=()), **shown)


@app.command("rename")
@operation
def rename(database: Database, run: _Run, name: str) -> None:
    """Give a run another name.

    Args:
        run: Name or id of the run.
        name: Its new name.
    """
    before = database.rename_run(run, name)
    print_status(f"run {before.run_id} renamed: {before.name} is {name}")


@app.command("label")
@operation
def label(database: Database, run: _Runs, labels: list[str]) -> None:
    """Say something of a run: which robot, which build.

    `runs list` and `info` show it, and --run KEY=VALUE means all runs with that label.

    Args:
        run: Name or id of the run, or all.
        labels (KEY=VALUE...): Labels; KEY= takes one away.
    """
    values: dict[str, str | None] = {}
    for text in labels:
        key, sign, value = text.partition("=")
        if not sign:
            raise UsageError(
                f"a label is KEY=VALUE — {text}",
                f"msgflow runs label {shlex.quote(run)} {shlex.quote(text)}=…",
            )
        if key in values:
            raise UsageError(f"a run has one label of a key — {key}", "give it once")
        values[key] = value or None
    for one in database.label_runs(run, **values):
        print_status(f"run {one.run_id} labelled: {one.name}")


@app.command("remove")
@operation
def remove(
    database: Database, run: _Runs, *, yes: Annotated[bool, typer.Option("--yes", "-y")] = False
) -> None:
    """Remove a run with all that is known of it; what other runs have stays as it is.

    On a terminal it asks first, unless --yes is given; a script is not asked.
    The file keeps its size, and the next ingest uses the space again.

    Args:
        run: Name or id of the run, or all.
        yes: Ask nothing on a terminal either.
    """
    if not yes:
        runs = choose_runs(database.runs(), run)
        # Other programs can use the database until the user answers.
        database.close()
        if not confirm(f"remove {', '.join(one.title for one in runs)}?"):
            print_status("nothing was removed")
            raise typer.Exit(ExitCode.INTERRUPTED)
    for one in database.remove_runs(run):
        print_status(f"run {one.run_id} removed: {one.name}")
