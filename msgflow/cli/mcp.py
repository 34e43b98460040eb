"""Serve the database to an agent, over stdin and stdout (Model Context Protocol)."""

from __future__ import annotations

from pathlib import Path

from msgflow.cli.operation import operation
from msgflow.files.default_files import DEFAULT_DATABASE


@operation
def command(*, database: Path = DEFAULT_DATABASE) -> None:
    """It only reads, and reaches no other file. It needs the extra mcp; in a checkout:
    pip install '.[mcp]'. The agent's program starts it, not you.
    """
    from msgflow.cli.signals import restore_default_actions
    from msgflow.mcp.server import make_server

    server = make_server(database)
    # The server only reads. It waits for the next line in a thread that no exception ends.
    restore_default_actions()
    server.run("stdio")
