"""Vertices and edges of the graph, from the rows of the query `graph`."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from msgflow.text.values import printable

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run

Row = dict[str, Any]


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
class GraphVertices:
    """Nodes, topics, services and actions of a run, and the messages between them."""

    run: Run
    result: QueryResult  # the rows of the query `graph`
    notes: list[str] = field(default_factory=list)  # what the rows do not say, a sentence each

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
