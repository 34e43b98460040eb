"""SVG picture of a graph: a lane for each executor, causes to the left of their effects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape, quoteattr

from msgflow.text.values import printable

if TYPE_CHECKING:
    from msgflow.export.graph_vertices import Edge, GraphVertices, Vertex

_LETTER = 6.6
_LINE = 14
_MOST_LETTERS = 40
# Space between columns whose arrows have labels, and other columns; between boxes of a column.
_WIDE, _NARROW, _ABOVE = 104, 44, 16
_MARGIN = 14
_TITLE = 20
_SWEEPS = 8
# For this picture only, also inside a page.
_STYLE = """
.msgflow-graph text { font: 11px sans-serif; fill: #1b2430; }
.msgflow-graph .small { font-size: 9.5px; fill: #5a6573; }
.msgflow-graph .said { paint-order: stroke; stroke: #f4f6f8; stroke-width: 4px; }
.msgflow-graph .lane { fill: #f4f6f8; stroke: #c9d1d9; }
.msgflow-graph .node { fill: #ffffff; stroke: #3d4653; }
.msgflow-graph .topic { fill: #e3eefb; stroke: #2f6fb0; }
.msgflow-graph .service, .msgflow-graph .action { fill: #fbf0dc; stroke: #a86b00; }
.msgflow-graph .action { stroke-width: 2.4; }
.msgflow-graph .edge { fill: none; stroke: #3d4653; stroke-width: 1.2; }
.msgflow-graph .call, .msgflow-graph .serve, .msgflow-graph .send, .msgflow-graph .execute {
  stroke: #a86b00;
}
.msgflow-graph .periodic_async { stroke: #aa4499; stroke-width: 1.8; stroke-dasharray: 8 4; }
.msgflow-graph .partial_sync, .msgflow-graph .approximate_sync {
  stroke: #aa4499; stroke-width: 1.8; stroke-dasharray: 2 4;
}
@media (prefers-color-scheme: dark) {
  .msgflow-graph { background: #14191f; }
  .msgflow-graph text { fill: #e6ebf0; }
  .msgflow-graph .small { fill: #9aa5b1; }
  .msgflow-graph .said { stroke: #1c232b; }
  .msgflow-graph .lane { fill: #1c232b; stroke: #39434e; }
  .msgflow-graph .node { fill: #14191f; stroke: #c3ccd6; }
  .msgflow-graph .topic { fill: #1b2f47; stroke: #6fa8dc; }
  .msgflow-graph .service, .msgflow-graph .action { fill: #3a2d12; stroke: #dba53a; }
  .msgflow-graph .edge { stroke: #c3ccd6; }
  .msgflow-graph .call, .msgflow-graph .serve, .msgflow-graph .send, .msgflow-graph .execute {
    stroke: #dba53a;
  }
  .msgflow-graph .periodic_async, .msgflow-graph .partial_sync,
  .msgflow-graph .approximate_sync { stroke: #d991cf; }
}
""".strip()


@dataclass
class _Box:
    vertex: Vertex
    lines: list[str]
    column: int = 0
    lane: int = 0
    rank: float = 0
    x: float = 0
    y: float = 0

    @property
    def width(self) -> float:
        return max(len(line) for line in self.lines) * _LETTER + 22

    @property
    def height(self) -> float:
        return len(self.lines) * _LINE + 12


def svg(graph: GraphVertices) -> str:
    """Return a graph as SVG. It holds no scripts and fetches nothing."""
    boxes = {vertex.id: _box(vertex) for vertex in graph.vertices.values()}
    _choose_columns(boxes, graph.edges)
    titles = _choose_lanes(boxes, graph)
    _order(boxes, graph.edges)
    lanes, width, height = _place(boxes, titles, graph.edges)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" class="msgflow-graph" width="{width:.0f}"'
        f' height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}" role="img">',
        f"<title>{escape(str(graph))}</title>",
        f"<style>{_STYLE}</style>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7"'
        ' markerHeight="7" orient="auto"><path d="M0,0 L8,4 L0,8 z" fill="context-stroke"/>'
        "</marker></defs>",
    ]
    for (top, bottom), title in zip(lanes, titles, strict=True):
        if title is not None:
            parts.append(
                f'<g><rect class="lane" x="4" y="{top:.0f}" width="{width - 8:.0f}"'
                f' height="{bottom - top:.0f}" rx="8"/><text class="small" x="12"'
                f' y="{top + 13:.0f}">{escape(_cut(title, 160))}</text>'
                f"<title>{escape(printable(title))}</title></g>"
            )
    parts += [_edge(edge, boxes[edge.source], boxes[edge.target], height) for edge in graph.edges]
    parts += [_shape(box) for box in boxes.values()]
    return "\n".join([*parts, "</svg>"])


def _box(vertex: Vertex) -> _Box:
    return _Box(vertex, [_cut(line, _MOST_LETTERS) for line in vertex.lines])


def _cut(text: str, most: int) -> str:
    text = printable(text)
    return text if len(text) <= most else f"…{text[1 - most :]}"


def _choose_columns(boxes: dict[str, _Box], edges: list[Edge]) -> None:
    """Put each box to the right of its causes; edges that close a loop do not count."""
    following: dict[str, list[str]] = {key: [] for key in boxes}
    entered = dict.fromkeys(boxes, 0)
    for edge in edges:
        following[edge.source].append(edge.target)
        entered[edge.target] += 1
    order: list[str] = []
    state = dict.fromkeys(boxes, 0)
    # Depth first: a box that is left later comes before all its effects.
    for root in sorted(boxes, key=lambda key: entered[key]):
        if state[root]:
            continue
        state[root] = 1
        stack = [(root, iter(following[root]))]
        while stack:
            key, rest = stack[-1]
            for target in rest:
                if not state[target]:
                    state[target] = 1
                    stack.append((target, iter(following[target])))
                    break
            else:
                order.append(key)
                stack.pop()
    order.reverse()
    places = {key: place for place, key in enumerate(order)}
    for key in order:
        for target in following[key]:
            if places[target] > places[key]:
                boxes[target].column = max(boxes[target].column, boxes[key].column + 1)


def _choose_lanes(boxes: dict[str, _Box], graph: GraphVertices) -> list[str | None]:
    """Give each executor a lane; a topic or service lies in the lane of its first sender."""
    executors = sorted(
        graph.executors,
        key=lambda key: (
            min(box.column for box in boxes.values() if box.vertex.executor == key),
            key,
        ),
    )
    numbers: dict[int | None, int] = {key: number for number, key in enumerate(executors)}
    numbers[None] = len(executors)
    for box in boxes.values():
        box.lane = numbers[box.vertex.executor]
    for edge in reversed(graph.edges):
        if edge.kind in ("publish", "call", "send"):
            boxes[edge.target].lane = boxes[edge.source].lane
    return [*(graph.executors[key] for key in executors), None]


def _order(boxes: dict[str, _Box], edges: list[Edge]) -> None:
    """Bring connected boxes to the same height, in every lane and column."""
    beside: dict[str, list[str]] = {key: [] for key in boxes}
    for edge in edges:
        beside[edge.source].append(edge.target)
        beside[edge.target].append(edge.source)
    cells: dict[tuple[int, int], list[str]] = {}
    for key, box in boxes.items():
        cells.setdefault((box.column, box.lane), []).append(key)
    for cell in cells.values():
        for rank, key in enumerate(cell):
            boxes[key].rank = rank
    for _ in range(_SWEEPS):
        for cell in cells.values():
            near = {
                key: sum(boxes[other].rank for other in beside[key]) / len(beside[key])
                for key in cell
            }
            for rank, key in enumerate(sorted(cell, key=lambda key: (near[key], key))):
                boxes[key].rank = rank


def _place(
    boxes: dict[str, _Box], titles: list[str | None], edges: list[Edge]
) -> tuple[list[tuple[float, float]], float, float]:
    """Set the corners of all boxes; return top and bottom of each lane, width and height."""
    spoken = {boxes[edge.source].column for edge in edges if edge.label}
    columns = range(max((box.column for box in boxes.values()), default=0) + 1)
    left = float(_MARGIN)
    starts = []
    for column in columns:
        starts.append(left)
        widths = [box.width for box in boxes.values() if box.column == column]
        left += max(widths, default=0) + (_WIDE if column in spoken else _NARROW)
    top = float(_MARGIN)
    lanes = []
    for lane, title in enumerate(titles):
        begin = top
        inside = top + (_TITLE if title is not None else 0)
        bottom = inside
        for column in columns:
            here = [box for box in boxes.values() if (box.lane, box.column) == (lane, column)]
            y = inside
            for box in sorted(here, key=lambda box: box.rank):
                box.x, box.y = starts[column], y
                y += box.height + _ABOVE
            bottom = max(bottom, y)
        lanes.append((begin, max(bottom - 4, begin + 1)))
        top = bottom + 8
    return lanes, max(left + _MARGIN, 200), top + _MARGIN


def _edge(edge: Edge, source: _Box, target: _Box, height: float) -> str:
    x0, y0 = source.x + source.width, source.y + source.height / 2
    x1, y1 = target.x, target.y + target.height / 2
    if x1 > x0:
        bend = max((x1 - x0) / 2, 24)
        path = f"M{x0:.1f},{y0:.1f} C{x0 + bend:.1f},{y0:.1f} {x1 - bend:.1f},{y1:.1f} "
        middle = ((x0 + x1) / 2, (y0 + y1) / 2)
    else:
        low = min(max(y0, y1) + 46, height - 4)
        path = f"M{x0:.1f},{y0:.1f} C{x0 + 70:.1f},{low:.1f} {x1 - 70:.1f},{low:.1f} "
        middle = ((x0 + x1) / 2, (y0 + y1) / 8 + low * 3 / 4)
    kinds = ["edge", edge.kind, *([edge.indirect.split(",")[0]] if edge.indirect else [])]
    said = f"{edge.kind}: {edge.count:,} in all"
    if edge.rate_hz:
        said += f", {edge.rate_hz:.4g} Hz"
    if edge.label:
        said += f"; median · p95: {edge.label}"
    if edge.indirect:
        said += f"; indirect link: {edge.indirect}"
    text = (
        f'<text class="small said" text-anchor="middle" x="{middle[0]:.1f}"'
        f' y="{middle[1] - 4:.1f}">{escape(edge.label)}</text>'
        if edge.label
        else ""
    )
    return (
        f'<g><path class={quoteattr(" ".join(kinds))} marker-end="url(#tip)"'
        f' d="{path}{x1:.1f},{y1:.1f}"/>{text}<title>{escape(said)}</title></g>'
    )


def _shape(box: _Box) -> str:
    kind = box.vertex.kind
    if kind in ("service", "action"):
        left, right = box.x, box.x + box.width
        top, bottom, middle = box.y, box.y + box.height, box.y + box.height / 2
        shape = (
            f'<path class="{kind}" d="M{left + 10:.1f},{top:.1f} L{right - 10:.1f},{top:.1f}'
            f" L{right:.1f},{middle:.1f} L{right - 10:.1f},{bottom:.1f}"
            f' L{left + 10:.1f},{bottom:.1f} L{left:.1f},{middle:.1f} z"/>'
        )
    else:
        round_by = box.height / 2 if kind == "topic" else 4
        shape = (
            f'<rect class="{kind}" x="{box.x:.1f}" y="{box.y:.1f}" width="{box.width:.1f}"'
            f' height="{box.height:.1f}" rx="{round_by:.1f}"/>'
        )
    texts = "".join(
        f'<text{" class=" + quoteattr("small") if place else ""} text-anchor="middle"'
        f' x="{box.x + box.width / 2:.1f}" y="{box.y + 18 + place * _LINE:.1f}">'
        f"{escape(line)}</text>"
        for place, line in enumerate(box.lines)
    )
    return f"<g>{shape}{texts}<title>{escape(printable(box.vertex.name))}</title></g>"
