"""Show the database in the browser: timeline, paths, graph, executors, comparison."""

from __future__ import annotations

from concurrent.futures import wait
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.operation import operation
from msgflow.cli.output import print_note, print_status
from msgflow.errors import MsgflowError
from msgflow.files.default_files import DEFAULT_DATABASE

# Without a limit, Windows would not notice Ctrl-C.
_SECONDS_BETWEEN_LOOKS = 0.1


@operation
def command(
    *,
    browser: bool = True,
    port: Annotated[int | None, typer.Option(min=0, max=65535)] = None,
    memory_limit: str | None = None,
    database: Path = DEFAULT_DATABASE,
) -> None:
    """The printed address contains a token; without it, nothing is shown. The server answers this
    machine only: from another one, open the same address through ssh -L. Ctrl-C stops it. While it
    runs, other programs can read the database, and write to it when no page has asked for some
    seconds.

    Args:
        browser: Open the address in the browser.
        port (NUMBER): Port on 127.0.0.1; 0 for any free one. By default 8642, else any free one.
        memory_limit: Maximum memory for queries. By default a quarter of the machine's, 500MB to
            4GB.
    """
    from msgflow.cli.sql_process import WarmSql
    from msgflow.view.server import serving
    from msgflow.view.sql_page import MOST_SECONDS

    with ExitStack() as stack:
        sql = WarmSql(database, memory_limit=memory_limit, seconds=MOST_SECONDS)
        stack.callback(sql.close)
        server = serving(database, sql, port=port, memory_limit=memory_limit)
        address, served = stack.enter_context(server)
        print_status(address)
        print_status("Ctrl-C ends it")
        if browser and not _open(address):
            print_note("no browser could be opened here: open the address yourself")
        while not wait([served], _SECONDS_BETWEEN_LOOKS).done:
            pass
        raise MsgflowError("the server of the pages has ended") from served.exception()


def _open(address: str) -> bool:
    import webbrowser

    try:
        return webbrowser.open(address)
    except (webbrowser.Error, OSError):
        return False
