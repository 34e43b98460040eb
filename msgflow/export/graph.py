"""Graph of nodes, topics, services and actions, in each format of `msgflow graph`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.backports import StrEnum
from msgflow.export.formats import SUFFIXES, Format, by_suffix
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.text.json_value import json_value
from msgflow.text.values import printable

if TYPE_CHECKING:
    import duckdb

    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice

Row = dict[str, Any]


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


_SHAPES = {
    "node": "shape=box",
    "topic": "shape=box, style=rounded",
    "service": "shape=hexagon",
    "action": "shape=octagon",
}
_STYLES = {
    "periodic_async": 'style=dashed, color="#aa4499"',
    "queue": 'style=dashed, color="#aa4499"',
    "partial_sync": 'style=dotted, color="#aa4499"',
    "approximate_sync": 'style=dotted, color="#aa4499"',
}
_BOXES = {
    "node": ("[", "]"),
    "topic": ("([", "])"),
    "service": ("{{", "}}"),
    "action": ("[[", "]]"),
}
# Characters that a Mermaid label may hold; all others are written as their number.
_PLAIN = set(" /_.,:-·%()→+*")


@dataclass(frozen=True)
class Vertex:
    """A node, topic, service or action."""

    id: str  # its name in edges, of letters and digits only
    kind: str  # 'node', 'topic', 'service' or 'action'
    name: str  # in the trace
    rate_hz: float | None = None  # messages of a topic per second; None: not known
    executor: int | None = None  # number of the executor that runs the node, in `Graph.executors`

    @property
    def lines(self) -> list[str]:
        """Its lines of text, without control characters."""
        rate = [] if self.rate_hz is None else [f"{self.rate_hz:.4g} Hz"]
        return [printable(self.name), *rate]


@dataclass(frozen=True)
class Edge:
    """An arrow between a node and a topic, service or action."""

    source: str  # id of its first vertex
    target: str  # id of its last vertex
    kind: str  # 'publish', 'receive', 'call', 'serve', 'send' or 'execute'
    # kind of the indirect links through which messages wait in the node; None: none
    indirect: str | None
    count: int  # messages, requests or goals
    rate_hz: float | None  # messages per second; None: not known
    median_ns: int | None  # median latency; None: not known
    p95_ns: int | None  # 95 % are at most this

    @property
    def label(self) -> str:
        """Median and p95, if they are known."""
        if self.median_ns is None or self.p95_ns is None:
            return ""
        return f"{_brief(self.median_ns)} · {_brief(self.p95_ns)}"

    @property
    def is_call(self) -> bool:
        """Whether it belongs to a service or an action."""
        return _far(self.kind) != "topic"


def _far(kind: str) -> str:
    """Return what is at the other end of an edge of this kind than the node."""
    far = {"call": "service", "serve": "service", "send": "action", "execute": "action"}
    return far.get(kind, "topic")


def _brief(duration_ns: int) -> str:
    """Return a duration with three digits: there is no room for more beside an arrow."""
    for size, unit in ((1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "µs")):
        if abs(duration_ns) >= size:
            return f"{float(f'{duration_ns / size:.3g}'):g} {unit}"
    return f"{duration_ns} ns"


@dataclass(frozen=True, repr=False)
class Graph:
    """Nodes, topics, services and actions of a run, and the messages between them.

    Attributes:
        run: the run.
        result: the rows of the query `graph`.
        notes: what the rows do not say, a sentence each.
    """

    run: Run
    result: QueryResult
    notes: list[str] = field(default_factory=list)

    @cached_property
    def rows(self) -> list[Row]:
        """The rows of the query."""
        rows: list[Row] = self.result.to_arrow().to_pylist()
        return rows

    @cached_property
    def executors(self) -> dict[int, str]:
        """Names of the executors with nodes in the graph, by their number."""
        found = {
            row["executor_id"]: row["executor"]
            for row in self.rows
            if row["executor_id"] is not None
        }
        return dict(sorted(found.items()))

    @cached_property
    def vertices(self) -> dict[tuple[str, str], Vertex]:
        """Vertices by kind and name."""
        rates: dict[str, float] = {}
        for row in self.rows:
            if row["kind"] == "publish" and row["rate_hz"] is not None:
                rates[row["name"]] = rates.get(row["name"], 0) + row["rate_hz"]
        found: dict[tuple[str, str], Vertex] = {}
        for row in self.rows:
            far = _far(row["kind"])
            for kind, name in (("node", row["node"]), (far, row["name"])):
                if (kind, name) not in found:
                    found[kind, name] = Vertex(
                        f"v{len(found)}",
                        kind,
                        name,
                        rates.get(name) if kind == "topic" else None,
                        row["executor_id"] if kind == "node" else None,
                    )
        return found

    @cached_property
    def edges(self) -> list[Edge]:
        """Edges, from sender to receiver."""
        found = []
        for row in self.rows:
            far = _far(row["kind"])
            source = self.vertices["node", row["node"]].id
            target = self.vertices[far, row["name"]].id
            if row["kind"] in ("receive", "serve", "execute"):
                source, target = target, source
            same = ("kind", "indirect", "count", "rate_hz", "median_ns", "p95_ns")
            found.append(Edge(source, target, **{name: row[name] for name in same}))
        return found

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
        """Return it in the language of Graphviz: executors are clusters."""
        lines = ["digraph msgflow {", "  rankdir=LR;", "  node [fontname=sans, fontsize=10];"]
        lines.append("  edge [fontname=sans, fontsize=8];")
        for number, (title, members) in enumerate(self._groups()):
            indent = "  "
            if title is not None:
                lines += [
                    f"  subgraph cluster_{number} {{",
                    f"    label={_quoted(title)}; fontname=sans; fontsize=9; style=rounded;",
                ]
                indent = "    "
            for vertex in members:
                label = "\\n".join(map(_escaped, vertex.lines))
                lines.append(f'{indent}{vertex.id} [label="{label}", {_SHAPES[vertex.kind]}];')
            if title is not None:
                lines.append("  }")
        for edge in self.edges:
            attributes = [f"label={_quoted(edge.label)}"] if edge.label else []
            attributes.append(f"tooltip={_quoted(f'{edge.kind}: {edge.count}')}")
            if edge.indirect:
                attributes.append(_STYLES[edge.indirect.split(",")[0]])
            elif edge.is_call:
                attributes.append("arrowhead=empty, color=gray40")
            lines.append(f"  {edge.source} -> {edge.target} [{', '.join(attributes)}];")
        return "\n".join([*lines, "}"])

    def to_mermaid(self) -> str:
        """Return it as a Mermaid flowchart: executors are subgraphs."""
        lines = ["flowchart LR"]
        for number, (title, members) in enumerate(self._groups()):
            if title is not None:
                lines.append(f'  subgraph g{number}["{_coded(title)}"]')
            for vertex in members:
                opening, closing = _BOXES[vertex.kind]
                label = "<br/>".join(map(_coded, vertex.lines))
                lines.append(f'  {vertex.id}{opening}"{label}"{closing}')
            if title is not None:
                lines.append("  end")
        for edge in self.edges:
            label = f'|"{_coded(edge.label)}"|' if edge.label else ""
            arrow = "-.->" if edge.indirect else "==>" if edge.is_call else "-->"
            lines.append(f"  {edge.source} {arrow}{label} {edge.target}")
        return "\n".join(lines)

    def to(self, form: GraphFormat) -> str:
        """Return it in a format."""
        write = {
            GraphFormat.DOT: self.to_dot,
            GraphFormat.MERMAID: self.to_mermaid,
            GraphFormat.JSON: self.to_json,
        }
        return write[form]()

    def _groups(self) -> Iterator[tuple[str | None, list[Vertex]]]:
        """Yield each executor with its nodes, and last the vertices without an executor."""
        for executor, title in self.executors.items():
            yield title, [one for one in self.vertices.values() if one.executor == executor]
        yield None, [one for one in self.vertices.values() if one.executor is None]

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


def _escaped(text: str) -> str:
    # A doubled backslash begins no escape of Graphviz (\N, \G, \l, …).
    return printable(text).replace("\\", "\\\\").replace('"', '\\"')


def _quoted(text: str) -> str:
    return f'"{_escaped(text)}"'


def _coded(text: str) -> str:
    return "".join(
        character
        if (character.isascii() and character.isalnum()) or character in _PLAIN
        else f"#{ord(character)};"
        for character in printable(text)
    )
