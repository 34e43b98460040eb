"""Graphviz and Mermaid text of a graph; names from a trace are always text in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.text.values import printable

if TYPE_CHECKING:
    from collections.abc import Iterator

    from msgflow.export.graph_vertices import Edge, GraphVertices, Vertex

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


def dot(graph: GraphVertices) -> str:
    """Return a graph in the language of Graphviz: executors are clusters."""
    lines = ["digraph msgflow {", "  rankdir=LR;", "  node [fontname=sans, fontsize=10];"]
    lines.append("  edge [fontname=sans, fontsize=8];")
    for number, (title, members) in enumerate(_groups(graph)):
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
    for edge in graph.edges:
        attributes = [f"label={_quoted(edge.label)}"] if edge.label else []
        attributes.append(f"tooltip={_quoted(f'{edge.kind}: {edge.count}')}")
        if edge.indirect:
            attributes.append(_STYLES[edge.indirect.split(",")[0]])
        elif edge.is_call:
            attributes.append("arrowhead=empty, color=gray40")
        lines.append(f"  {edge.source} -> {edge.target} [{', '.join(attributes)}];")
    return "\n".join([*lines, "}"])


def mermaid(graph: GraphVertices) -> str:
    """Return a graph as a Mermaid flowchart: executors are subgraphs."""
    lines = ["flowchart LR"]
    for number, (title, members) in enumerate(_groups(graph)):
        if title is not None:
            lines.append(f'  subgraph g{number}["{_coded(title)}"]')
        for vertex in members:
            opening, closing = _BOXES[vertex.kind]
            label = "<br/>".join(map(_coded, vertex.lines))
            lines.append(f'  {vertex.id}{opening}"{label}"{closing}')
        if title is not None:
            lines.append("  end")
    for edge in graph.edges:
        label = f'|"{_coded(edge.label)}"|' if edge.label else ""
        lines.append(f"  {edge.source} {_arrow(edge)}{label} {edge.target}")
    return "\n".join(lines)


def _arrow(edge: Edge) -> str:
    if edge.indirect:
        return "-.->"
    return "==>" if edge.is_call else "-->"


def _groups(graph: GraphVertices) -> Iterator[tuple[str | None, list[Vertex]]]:
    """Yield each executor with its nodes, and last the vertices without an executor."""
    for executor, title in graph.executors.items():
        yield title, [one for one in graph.vertices.values() if one.executor == executor]
    yield None, [one for one in graph.vertices.values() if one.executor is None]


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
