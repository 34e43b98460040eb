"""msgflow: ROS 2 traces as a relational database.

Example:
    with msgflow.open_db("msgflow.duckdb") as database:
        database.ingest("traces/session")
        print(database.query("e2e-latency").to_pandas())
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from msgflow.version import __version__

if TYPE_CHECKING:
    from msgflow.database import Database, open_db
    from msgflow.errors import (
        DatabaseError,
        ExitCode,
        MsgflowError,
        QueryError,
        TraceError,
        UsageError,
    )
    from msgflow.result.query_result import QueryResult
    from msgflow.run.slice import Slice

__all__ = [
    "Database",
    "DatabaseError",
    "ExitCode",
    "MsgflowError",
    "QueryError",
    "QueryResult",
    "Slice",
    "TraceError",
    "UsageError",
    "__version__",
    "open_db",
]

_HOMES = ("msgflow.errors", "msgflow.run.slice", "msgflow.database", "msgflow.result.query_result")


def __getattr__(name: str) -> Any:
    # Lazily, so that `msgflow --help` does not pay for the database stack.
    for home in _HOMES if name in __all__ else ():
        module = import_module(home)
        if hasattr(module, name):
            return getattr(module, name)
    raise AttributeError(f"module 'msgflow' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
