"""Graph of nodes, topics, services and actions, in each format of `msgflow graph`."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from msgflow.export.formats import SUFFIXES, Format, by_suffix
from msgflow.export.graph_vertices import GraphVertices
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.text.json_value import json_value
from msgflow.text.values import printable

if TYPE_CHECKING:
    from pathlib import Path

    import duckdb

    from msgflow.run.slice import Slice


class GraphFormat(StrEnum):
    """A format of graphs."""

    DOT = "dot"
    MERMAID = "mermaid"
    JSON = "json"


_SUFFIXES: dict[str, GraphFormat | Format] = {
    **SUFFIXES,
    ".dot": GraphFormat.DOT,
    ".gv": GraphFormat.DOT,
    ".mmd": GraphFormat.MERMAID,
    ".mermaid": GraphFormat.MERMAID,
    ".json": GraphFormat.JSON,
}
_PICTURE = "; for a picture: msgflow graph | dot -Tsvg, or msgflow ui, page Graph"


def graph_format(path: Path | None) -> GraphFormat | Format:
    """Return the format for the suffix of a file, of graphs or of rows; DOT without a file."""
    return GraphFormat.DOT if path is None else by_suffix(path, _SUFFIXES, _PICTURE)


@dataclass(frozen=True, repr=False)
class Graph(GraphVertices):
    """Nodes, topics, services and actions of a run, as `GraphVertices` describes them."""

    def to_json(self) -> str:
        """Return executors, nodes and edges as JSON."""
        content = {
            "run_id": self.run.run_id,
            "run": self.run.name,
            "executors": [{"id": key, "name": name} for key, name in self.executors.items()],
            "vertices": [json_value(vars(vertex)) for vertex in self.vertices.values()],
            "edges": [json_value(vars(edge)) for edge in self.edges],
        }
        return json.dumps(content, ensure_ascii=False, indent=1)

    def to_dot(self) -> str:
        """Return it in the language of Graphviz."""
        from msgflow.export.graph_text import dot

        return dot(self)

    def to_mermaid(self) -> str:
        """Return it as a Mermaid flowchart."""
        from msgflow.export.graph_text import mermaid

        return mermaid(self)

    def to(self, form: GraphFormat) -> str:
        """Return it in a format."""
        write = {
            GraphFormat.DOT: self.to_dot,
            GraphFormat.MERMAID: self.to_mermaid,
            GraphFormat.JSON: self.to_json,
        }
        return write[form]()

    def __repr__(self) -> str:
        return f"<{self}>"

    def __str__(self) -> str:
        kinds = [vertex.kind for vertex in self.vertices.values()]
        return (
            f"graph of run {printable(self.run.name)}: {kinds.count('node')} nodes, "
            f"{kinds.count('topic')} topics, {kinds.count('service')} services, "
            f"{kinds.count('action')} actions"
        )

    def _repr_mimebundle_(self, **_: Any) -> dict[str, str]:
        # Notebooks draw Mermaid.
        return {"text/plain": repr(self), "text/vnd.mermaid": self.to_mermaid()}


def read_graph(
    connection: duckdb.DuckDBPyConnection, part: Slice, *, internal: bool = False
) -> Graph:
    """Return the graph of a run."""
    run = part.one_run(connection, "a graph")
    header = load_query("graph")
    result = run_query(connection, header, {}, replace(part, run=run.run_id), internal=internal)
    return Graph(run, result, result.notes)
