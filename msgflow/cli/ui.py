"""Show the database in the browser: timeline, paths, graph, executors, comparison."""

from __future__ import annotations

import os
from concurrent.futures import Future, wait
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.operation import operation
from msgflow.cli.options import LAKE_PAGE
from msgflow.cli.output import print_note, print_status
from msgflow.errors import MsgflowError, UsageError
from msgflow.files.default_files import DEFAULT_DATABASE

# Without a limit, Windows would not notice Ctrl-C.
_SECONDS_BETWEEN_LOOKS = 0.1


@operation
def command(
    *,
    browser: bool = True,
    port: Annotated[int | None, typer.Option(min=0, max=65535)] = None,
    memory_limit: str | None = None,
    lake: Annotated[str | None, LAKE_PAGE] = None,
    where: str | None = None,
    database: Path = DEFAULT_DATABASE,
) -> None:
    """With --lake: paths of all runs of a lake by label over time, outliers, failures.

    The printed address contains a token; without it, nothing is shown. The server answers this
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
        if lake is not None:
            server = _serving_lake(lake, where, port)
        else:
            require_no_where(where)
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


def _serving_lake(
    lake: str, where: str | None, port: int | None
) -> AbstractContextManager[tuple[str, Future[None]]]:
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.lake_page import lake_page
    from msgflow.view.server import serving_application, single_application

    opened = Lake.open(lake)
    # Made once before the browser asks, so that errors are printed here.
    first = [lake_page(opened, where=where).content]

    def page() -> str:
        return first.pop() if first else lake_page(opened, where=where).content

    place = lake if "://" in lake else os.path.realpath(lake)
    return serving_application(place, port, lambda token: single_application(page, token))


def require_no_where(where: str | None) -> None:
    """Raise an error if --where is given without --lake."""
    if where is not None:
        raise UsageError("--where chooses runs of a lake", "--lake PATH")


def _open(address: str) -> bool:
    import webbrowser

    try:
        return webbrowser.open(address)
    except (webbrowser.Error, OSError):
        return False
