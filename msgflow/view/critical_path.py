"""Critical path of a picked flow, from the query critical-path."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pyarrow as pa

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow.text.shell import shell_joined
from msgflow.view.encoded import encoded_result
from msgflow.view.page_query import run_page_query
from msgflow.view.table_encoding import encode

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run


def critical_path(
    connection: duckdb.DuckDBPyConnection,
    run: Run,
    origin_ns: int,
    kind: str,
    number: int,
    from_topic: str | None = None,
) -> bytes:
    """Return the pieces of the critical path as bytes, with the command that prints them.

    It belongs to the longest flow that ends where the picked one does, see critical_end.sql. It
    starts on `from_topic`, or when None on the topic of its first message.
    """
    ends = run_page_query(connection, "critical_end", {"kind": kind, "id": number}).to_pylist()
    if not ends:
        return encode(pa.table({"at_ns": pa.array([], pa.int64())}))
    (end,) = ends
    first = from_topic or end["from_topic"]
    asked = {
        "from": [first],
        "to": [end["to_topic"]],
        "take": end["take_id"],
        # Whatever was picked has a flow, also one that is not the first arrival of its root.
        "case": "every_pair",
        "detail": "full",
    }
    header = load_query("critical-path")
    result = run_query(connection, header, asked, Slice(run.run_id))
    command = ["msgflow", "flow", "--take", str(asked["take"]), "--why"]
    # The page shows the path itself.
    shown = replace(
        result,
        table=result.table.drop_columns(["path"]),
        header=replace(header, columns=tuple(c for c in header.columns if c.name != "path")),
    )
    meta = {
        "from": first,
        "to": end["to_topic"],
        "take_id": asked["take"],
        "command": shell_joined([*command, "--from", first, "--detail", "full"]),
    }
    return encoded_result(shown, meta, origin_ns)
