"""The page of one flow: the timeline of one message in one file (`msgflow flow --html`)."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pyarrow as pa
from pyarrow import compute

from msgflow.files.atomic import replacing
from msgflow.query.flow import STEPS_PER_MESSAGE
from msgflow.run.choice import Run
from msgflow.run.window import Window
from msgflow.view.assets import single_page
from msgflow.view.page_query import Params, Question, run_page_query
from msgflow.view.pages import Pages, critical_path
from msgflow.view.table_encoding import encode

_BAR = ["row_key", "kind", "id", "start_at", "length", "flags"]
# Vertices of the whole flow, without limits.
_COUNTS = {
    direction: f"SELECT count(*) FROM main.flow_{direction}(?, ?)"
    for direction in ("forward", "backward", "both")
}


def write_flow_page(
    connection: duckdb.DuckDBPyConnection,
    path: Path,
    run: Run,
    kind: str,
    number: int,
    *,
    direction: str,
    depth: int,
    limit: int,
) -> int:
    """Write the timeline of everything that a thing led to and came from; return its bytes."""
    pages = Pages()
    params: Params = {"run": str(run.run_id)}
    asked = Question(connection, {**params, "kind": kind, "id": number})
    flow = run_page_query(connection, "flow", {
        "origin_ns": asked.origin_ns, "kind": kind, "id": number, "direction": direction,
        "limit": limit, "steps": depth * STEPS_PER_MESSAGE,
    })  # fmt: skip
    ((count,),) = connection.execute(_COUNTS[direction], [kind, number]).fetchall()
    bars = flow.group_by(_BAR, use_threads=False).aggregate([])
    begin = compute.min(bars["start_at"]).as_py() or 0
    end = compute.max(compute.add(bars["start_at"], bars["length"])).as_py() or 0
    known = compute.is_valid(flow["from_id"])
    edges = flow.filter(known).select(["kind", "id", "from_kind", "from_id", "link_kind"])
    window = Window(asked.origin_ns + begin - 1, asked.origin_ns + end + 1)
    rows = asked.rows("row")
    links = asked.links(2**40, window)
    events = asked.rows("event", window)
    instances = bars.filter(compute.equal(bars["kind"], 0))["id"]
    events = events.filter(compute.is_in(events["id"], instances))
    shown = pa.concat_tables([bars, events.select(bars.column_names).cast(bars.schema)])
    shown = shown.sort_by([(name, "ascending") for name in ("row_key", "start_at", "kind", "id")])
    notes = []
    if count > bars.num_rows:
        notes.append(
            f"{bars.num_rows:,} of {count:,} vertices of the flow are here"
            f" (--depth {depth}, --limit {limit})."
        )
    parts: dict[str, bytes] = {}
    parts["run"] = encode(run_page_query(connection, "run", {"run": run.run_id}))
    parts["row?"] = encode(rows.filter(compute.is_in(rows["row_key"], shown["row_key"])))
    for name in ("gap", "thread_name"):
        parts[f"{name}?"] = pages.answer(connection, name, params)
    parts[f"critical?id={number}&kind={kind}"] = critical_path(asked)
    parts["detail?place=0"] = encode(shown)
    # Arrows that lead to a bar of the flow, from a row of it.
    to_bars = links.filter(compute.is_in(links["from_row"], bars["row_key"])).join(
        bars.select(["row_key", "start_at"]).group_by(["row_key", "start_at"]).aggregate([]),
        keys=["to_row", "to_at"],
        right_keys=["row_key", "start_at"],
        join_type="left semi",
    )
    parts["links?place=0"] = encode(to_bars)
    parts["edge?"] = encode(edges.rename_columns(["to_kind", "to_id", *edges.column_names[2:]]))
    pages.close()
    head = {
        "start": begin,
        "end": end,
        "stretches": [{"start": begin, "end": end, "whole": True}],
        "count": bars.num_rows,
        "notes": notes,
        "pages": ["timeline"],
        "address": f"#/timeline?flow={kind}:{number}",
    }
    page = single_page(parts, head).encode()
    with replacing(path) as temporary:
        temporary.write_bytes(page)
    return len(page)
