"""`msgflow export`: the content of a database as files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.options import DEFAULT_DATABASE, DatabaseOption

app = typer.Typer(help="Write the content of a database to files.")


@app.callback()
def group() -> None:
    """Write the content of a database to files."""


@app.command("parquet")
def parquet(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Created if missing")],
    views: Annotated[
        list[str] | None, typer.Argument(metavar="[VIEW]...", help="All public views if none")
    ] = None,
    run: Annotated[str, typer.Option("--run", metavar="NAME|ID|all", help="Run to export")] = "all",
    force: Annotated[bool, typer.Option("--force", help="Replace files that exist")] = False,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write each public view to DIR/VIEW.parquet, with the schema revision in its metadata."""
    from msgflow.cli.output import count, print_status
    from msgflow.database import Database

    with Database(database) as opened:
        exported = opened.export_parquet(directory, views or (), run=run, force=force)
    rows = sum(view.row_count for view in exported)
    print_status(f"{count(len(exported), 'view')}, {count(rows, 'row')} written to {directory}")
