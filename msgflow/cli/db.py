"""Upgrade and describe a database file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msgflow.backports import Unpack
from msgflow.cli.completion import complete
from msgflow.cli.operation import operation
from msgflow.cli.output import Shown, print_result, print_status
from msgflow.database import Database
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.text.values import count

app = typer.Typer()


@app.command("upgrade")
@operation
def upgrade(*, database: Path = DEFAULT_DATABASE) -> None:
    """Upgrade a database to the schema and views of this version of msgflow."""
    from msgflow.db.migration import upgrade as upgrade_database

    done = upgrade_database(database)
    if done.before == done.after and not done.views_changed and not done.rederived_runs:
        print_status(f"{database} is up to date (schema revision {done.after})")
        return
    print_status(f"{database}: schema revision {done.before or 'none'} to {done.after}")
    if done.rederived_runs:
        print_status(f"links derived anew for {count(len(done.rederived_runs), 'run')}")


@app.command("schema")
@operation
def schema(
    database: Database,
    view: Annotated[str | None, typer.Argument(autocompletion=complete("view"))] = None,
    **shown: Unpack[Shown],
) -> None:
    """List the public views; with the name of one, its columns with type and meaning.

    Args:
        view ([VIEW]): A view: list its columns.
    """
    print_result(database.views() if view is None else database.schema(view), **shown)
