"""`msgflow ui`: the pictures of a database, in the browser."""

from __future__ import annotations

from typing import Annotated

import typer

from msgflow.cli.options import DEFAULT_DATABASE, DatabaseOption


def command(
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the address in the browser")
    ] = True,
    port: Annotated[
        int | None,
        typer.Option(
            "--port",
            metavar="NUMBER",
            min=0,
            max=65535,
            help="Port of 127.0.0.1; 0 takes any that is free",
            show_default="8642, or any that is free",
        ),
    ] = None,
    memory_limit: Annotated[
        str,
        typer.Option("--memory-limit", metavar="SIZE", help="Most memory that queries take"),
    ] = "300MB",
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Show the database in the browser: timeline, paths, graph, executors, comparison.

    The address has a token, without which nothing is shown. Only this machine is answered; from
    another one, open the same address behind ssh -L. Ctrl-C ends it. While it runs, the file can be
    read by others, and not be written.
    """
    from msgflow.cli.output import print_note, print_status
    from msgflow.view.server import serve

    def started(address: str) -> None:
        print_status(f"{address}\nCtrl-C ends it")
        if browser and not _open(address):
            print_note("no browser could be opened here: open the address yourself")

    serve(database, port=port, memory_limit=memory_limit, started=started)


def _open(address: str) -> bool:
    import webbrowser

    try:
        return webbrowser.open(address)
    except (webbrowser.Error, OSError):
        return False
