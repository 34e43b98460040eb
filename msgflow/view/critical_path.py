"""Critical path of a picked flow, from the query critical-path."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pyarrow as pa

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow.text.shell import shell_joined
from msgflow.view.page_query import run_page_query
from msgflow.view.table_encoding import encode, encode_result

if TYPE_CHECKING:
    from msgflow.sql.value import Value
    from msgflow.view.question import Question


def critical_path(asked: Question) -> bytes:
    """Return the pieces of the critical path as bytes, with the command that prints them.

    It belongs to the longest flow that ends where the picked one does, see critical_end.sql. It
    starts on the topic `from`, or without it on the topic of its first message.
    """
    picked: dict[str, Value] = {"kind": asked.kind, "id": asked.whole("id")}
    ends = run_page_query(asked.connection, "critical_end", picked).to_pylist()
    if not ends:
        return encode(pa.table({"at_ns": pa.array([], pa.int64())}))
    (end,) = ends
    first = str(asked.params.get("from") or end["from_topic"])
    chosen: dict[str, Value] = {
        "from": [first],
        "to": [end["to_topic"]],
        "take": end["take_id"],
        # Whatever was picked has a flow, also one that is not the first arrival of its root.
        "case": "every_pair",
        "detail": "full",
    }
    header = load_query("critical-path")
    result = run_query(asked.connection, header, chosen, Slice(asked.run.run_id))
    command = ["msgflow", "flow", "--take", str(end["take_id"]), "--why"]
    # The page shows the path itself.
    shown = replace(
        result,
        table=result.table.drop_columns(["path"]),
        header=replace(header, columns=tuple(c for c in header.columns if c.name != "path")),
    )
    meta = {
        "from": first,
        "to": end["to_topic"],
        "take_id": end["take_id"],
        "command": shell_joined([*command, "--from", first, "--detail", "full"]),
    }
    return encode_result(shown, meta, asked.origin_ns)
