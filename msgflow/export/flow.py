"""Flow of one message: as a text tree, as JSON, or as an Arrow table."""

from __future__ import annotations

import json
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

from msgflow.export.flow_tree import tree_text
from msgflow.export.flow_vertices import FlowVertices
from msgflow.query.clock_notes import clock_notes
from msgflow.query.flow import STEPS_PER_MESSAGE, flow_parameters, read_steps, require_start
from msgflow.text.json_value import json_value

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.export.flow_vertices import Row
    from msgflow.query.flow import Start
    from msgflow.sql.value import Value


@dataclass(frozen=True, repr=False)
class Flow(FlowVertices):
    """The causes and effects of one message; `str` of it is the tree of `msgflow flow`."""

    def to_arrow(self) -> pa.Table:
        """Return the rows, as `table` has them, as a pyarrow.Table."""
        return self.table

    def to_dict(self) -> Row:
        """Return run, start, nodes and edges as JSON values."""
        return {
            "run_id": self.run.run_id,
            "run": self.run.name,
            "start": {"kind": self.start.kind, "id": self.start.id},
            "direction": self.direction,
            "is_cut": self.is_cut,
            "nodes": json_value(list(self.nodes.values())),
            "edges": json_value(self.edges),
        }

    def to_json(self) -> str:
        """Return what `to_dict` returns as JSON, one node or edge per line."""
        content = self.to_dict()
        parts = []
        for name, value in content.items():
            if name in ("nodes", "edges") and value:
                rows = ",\n    ".join(json.dumps(row, ensure_ascii=False) for row in value)
                parts.append(f'  "{name}": [\n    {rows}\n  ]')
            else:
                parts.append(f'  "{name}": {json.dumps(value, ensure_ascii=False)}')
        return "{\n" + ",\n".join(parts) + "\n}"

    def __repr__(self) -> str:
        return f"<Flow of {self.start.kind} {self.start.id}: {len(self.nodes)} nodes>"

    def __str__(self) -> str:
        return tree_text(self)

    def _repr_html_(self) -> str:
        return f'<pre style="line-height: 1.2">{escape(str(self))}</pre>'


def read_flow(connection: duckdb.DuckDBPyConnection, /, start: Start, **given: Value) -> Flow:
    """Return the flow through `start`; `given` are parameters of `internal.flow_steps`."""
    run = require_start(connection, start)
    asked = flow_parameters(start, run, given)
    table = read_steps(connection, asked)
    flow = Flow(
        start, asked["direction"], asked["depth"], asked["limit"], run, table, list(start.notes)
    )
    flow.notes.extend(_notes(flow))
    if len({node["host"] for node in flow.nodes.values()}) > 1:
        flow.notes.extend(clock_notes(connection, [run]))
    return flow


def _notes(flow: Flow) -> list[str]:
    notes = []
    hidden = sum(node["internal_count"] or 0 for node in flow.nodes.values())
    if hidden:
        messages = "1 message" if hidden == 1 else f"{hidden} messages"
        notes.append(
            f"{messages} on topics and services of ROS itself left out; --internal shows them"
        )
    cut = [node for node in flow.nodes.values() if node["cut_count"]]
    by_depth = sum(abs(node["depth"]) >= flow.depth * STEPS_PER_MESSAGE for node in cut)
    for number, option, value in (
        (by_depth, "--depth", flow.depth),
        (len(cut) - by_depth, "--limit", flow.limit),
    ):
        if number:
            places = "1 place" if number == 1 else f"{number} places"
            notes.append(f"the flow goes on at {places} beyond {option} {value}")
    return notes
