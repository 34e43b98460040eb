"""Layout of the tree of a flow: chains go straight down, branches aside, nothing is drawn twice."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

Key = tuple[str, int]
Row = dict[str, Any]
# What a subscription did not take has such a vertex, and the status of the message as its link.
NOT_TAKEN = "subscription"


@dataclass(eq=False)
class Item:
    """A vertex, a take with the callback instance that it was for, or a message not taken."""

    node: Row  # the vertex; the callback instance if it is drawn together with its take
    take: Row | None = None  # that take
    handover: Row | None = None  # the link from the take to the callback instance
    number: int | None = None  # set if another line refers to this one
    # items that lead here, with the links
    causes: list[tuple[Item, Row]] = field(default_factory=list)
    # items that this leads to, with the links
    effects: list[tuple[Item, Row]] = field(default_factory=list)


@dataclass(frozen=True)
class Line:
    """An item where it is drawn."""

    item: Item  # what to draw
    link: Row | None  # the link from the line before, None for the first
    is_reference: bool = False  # another line draws the item


@dataclass(eq=False)
class Branch:
    """Lines that follow each other straight, and the branches after the last one."""

    depth: int = 0
    lines: list[Line] = field(default_factory=list)
    children: list[Branch] = field(default_factory=list)


def lay_out_flow(
    nodes: Mapping[Key, Row], edges: Sequence[Row], start: Key, direction: str
) -> list[Branch]:
    """Return a branch for each first item: all items without a cause, or the start."""
    items = _items(nodes, edges)
    tops = _tops(items, items[start]) if direction == "both" else [items[start]]
    return _grow(tops, is_backward=direction == "backward")


def walk(branches: Sequence[Branch]) -> Iterator[Branch]:
    """Yield all branches from top to bottom."""
    stack = list(reversed(branches))
    while stack:
        branch = stack.pop()
        yield branch
        stack += reversed(branch.children)


def _items(nodes: Mapping[Key, Row], edges: Sequence[Row]) -> dict[Key, Item]:
    calls: dict[Key, list[Row]] = defaultdict(list)
    for edge in edges:
        if edge["link_kind"] == "callback":
            calls[edge["from_kind"], edge["from_id"]].append(edge)
    items: dict[Key, Item] = {}
    for key, node in nodes.items():
        if node["kind"] not in ("take", "subscription"):
            items[key] = Item(node)
    for key, node in nodes.items():
        if node["kind"] != "take":
            continue
        callback = None
        if len(calls[key]) == 1:
            callback = items["callback_instance", calls[key][0]["to_id"]]
        if callback is not None and callback.take is None:
            callback.take, callback.handover = node, calls[key][0]
            items[key] = callback
        else:
            items[key] = Item(node)
    for edge in edges:
        cause = items[edge["from_kind"], edge["from_id"]]
        target = (edge["to_kind"], edge["to_id"])
        effect = Item(nodes[target]) if edge["to_kind"] == NOT_TAKEN else items[target]
        if edge is not effect.handover:
            cause.effects.append((effect, edge))
            effect.causes.append((cause, edge))
    return items


def _tops(items: dict[Key, Item], start: Item) -> list[Item]:
    unique = sorted(dict.fromkeys(items.values()), key=_order)
    tops = [item for item in unique if not item.causes]
    reached = set(tops)
    stack = list(tops)
    while stack:
        for effect, _ in stack.pop().effects:
            if effect not in reached:
                reached.add(effect)
                stack.append(effect)
    # In a ring every item has a cause: the tree begins with the start.
    return tops if start in reached else [*tops, start]


def _grow(tops: Sequence[Item], *, is_backward: bool) -> list[Branch]:
    branches = [Branch() for _ in tops]
    stack = [(branch, Line(item, None)) for branch, item in zip(branches, tops, strict=True)]
    stack.reverse()
    drawn: set[Item] = set()
    referred: set[Item] = set()
    while stack:
        branch, line = stack.pop()
        following = [line]
        while len(following) == 1:
            (line,) = following
            if line.item in drawn:
                branch.lines.append(Line(line.item, line.link, is_reference=True))
                referred.add(line.item)
                following = []
            else:
                branch.lines.append(line)
                drawn.add(line.item)
                pairs = line.item.causes if is_backward else line.item.effects
                ordered = sorted(pairs, key=lambda pair: _order(pair[0]))
                following = [Line(other, link) for other, link in ordered]
        branch.children = [Branch(branch.depth + 1) for _ in following]
        stack += reversed(list(zip(branch.children, following, strict=True)))
    number = 0
    for branch in walk(branches):
        for line in branch.lines:
            if line.item in referred and not line.is_reference:
                number += 1
                line.item.number = number
    return branches


def _order(item: Item) -> tuple[bool, int, str, int]:
    start_ns = item.node["start_ns"]
    return (start_ns is None, start_ns or 0, item.node["kind"], item.node["id"])
