"""Flow of one message: as a text tree, as JSON, or as an Arrow table."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from msgflow.export.flow_layout import NOT_TAKEN, lay_out_flow, walk
from msgflow.query.flow import STEPS_PER_MESSAGE, read_steps, require_start
from msgflow.query.notes import clock_notes
from msgflow.run.window import format_epoch
from msgflow.text.json_value import json_value
from msgflow.text.values import format_cell, format_duration, short_symbol
from msgflow.text.wrapping import words

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.export.flow_layout import Branch, Item, Key, Line, Row
    from msgflow.query.flow import Start
    from msgflow.run.choice import Run
    from msgflow.sql.value import Value

_LINK = ("link_kind", "wait_ns", "stored_ns", "candidate_count", "is_loss_affected")
_OF_EDGE = {"run_id", "from_kind", "from_id", *_LINK}
_STATE = ("missing", "reason", "cut_count", "internal_count")
_UNBOUNDED = 100_000
_LEAST_WIDTH = 44
_INDENT = 4
_GAP = 2
# In place of a space where no line may break. It is not printable: no name has it.
_BOUND = "\ue000"
# Links that describe the effect in either direction, or need no words.
_OF_EFFECT = ("transport", "service", "callback", "direct")
# Reasons of the status 'unknown': the message may have been taken after all.
_REQUEST = {
    "callback": "no callback was seen",
    "sending": "its sending was not seen",
    "response": "no response was seen",
}
_NOT_SEEN = {
    "take": {"publication": "its publication was not seen", "callback": "no callback was seen"},
    "callback_instance": {"take": "its message was not seen"},
    "request": _REQUEST,
    "response": _REQUEST,
}


@dataclass(frozen=True, repr=False)
class Flow:
    """The causes and effects of one message. Times are integers in nanoseconds.

    `str` of it is the tree that `msgflow flow` prints.

    Attributes:
        start: where it begins.
        direction: 'forward', 'backward' or 'both'.
        depth: most messages in a row, each way.
        limit: most vertices.
        run: its run.
        table: the rows of `main.flow_step`, nearest to the start first, with the bounds of
            `main.executor_wait` for how long the executor was busy (busy_min_ns, busy_max_ns), and
            when the thread of a publication went on at the latest (until_ns), and the user's events
            in a callback instance: name, event_count, first_ns (user_events), and what its node
            publishes for other reasons, if all its messages end there (otherwise_published), and
            how long a message was stored until its subscription existed (stored_ns), and the
            services that a callback instance waited for: service, server, waited_ns, queue_ns,
            served_ns (calls).
        notes: what the rows do not say, a sentence each.
    """

    start: Start
    direction: str
    depth: int
    limit: int
    run: Run
    table: pa.Table
    notes: list[str] = field(default_factory=list)

    @property
    def start_key(self) -> Key:
        """The vertex where it begins, as (kind, id)."""
        return (self.start.kind, self.start.id)

    @property
    def is_cut(self) -> bool:
        """Whether the flow goes on beyond depth or limit."""
        return any(node["cut_count"] for node in self.nodes.values())

    @cached_property
    def nodes(self) -> dict[Key, Row]:
        """Vertices by (kind, id), nearest to the start first."""
        found: dict[Key, Row] = {}
        for row in self.table.to_pylist():
            node = {name: value for name, value in row.items() if name not in _OF_EDGE}
            # The edge says that a message was not taken: the subscription may miss several.
            node |= dict.fromkeys(_STATE) if row["kind"] == NOT_TAKEN else {}
            found.setdefault((row["kind"], row["id"]), node)
        return found

    @cached_property
    def edges(self) -> list[Row]:
        """Links between the vertices, from cause to effect."""
        return [
            {
                "from_kind": row["from_kind"],
                "from_id": row["from_id"],
                "to_kind": row["kind"],
                "to_id": row["id"],
                **{name: row[name] for name in _LINK},
                "reason": row["reason"] if row["kind"] == NOT_TAKEN else None,
            }
            for row in self.table.to_pylist()
            if row["from_kind"] is not None
        ]

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
        """Return what `to_dict` returns as JSON."""
        return json.dumps(self.to_dict(), ensure_ascii=False, indent=1)

    def __repr__(self) -> str:
        return f"<Flow of {self.start.kind} {self.start.id}: {len(self.nodes)} nodes>"

    def __str__(self) -> str:
        return tree_text(self)

    def _repr_html_(self) -> str:
        return f'<pre style="line-height: 1.2">{escape(str(self))}</pre>'


def read_flow(connection: duckdb.DuckDBPyConnection, /, start: Start, **given: Value) -> Flow:
    """Return the flow through `start`; `given` are parameters of `internal.flow_steps`."""
    run = require_start(connection, start)
    asked, table = read_steps(connection, start, run, given)
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


def tree_text(
    flow: Flow, *, is_absolute: bool = False, width: int | None = None, color: bool = False
) -> str:
    """Return the tree of a flow; a line begins with its time since the first line.

    Nothing is drawn twice: a later line refers to the first one by its number in brackets.
    """
    branches = lay_out_flow(flow.nodes, flow.edges, flow.start_key, flow.direction)
    stream = io.StringIO()
    deepest = _INDENT * max(branch.depth for branch in walk(branches))
    cells = _UNBOUNDED if width is None else max(width, deepest + _LEAST_WIDTH)
    painter = _Painter(flow, branches, is_absolute, cells)
    console = Console(
        file=stream,
        width=cells,
        force_terminal=color,
        # In a notebook Rich would draw there, not into the text.
        force_jupyter=False,
        color_system="standard" if color else None,
        highlight=False,
        markup=False,
        emoji=False,
        legacy_windows=False,
    )
    console.print(painter.title(), width=width)
    for branch in branches:
        console.print(_tree(branch, painter))
    text = stream.getvalue().replace(_BOUND, " ")
    return "\n".join(line.rstrip() for line in text.splitlines())


def _tree(top: Branch, painter: _Painter) -> Tree:
    tree = Tree(painter.label(top), guide_style="dim")
    stack = [(tree, top)]
    while stack:
        parent, branch = stack.pop()
        for child in branch.children:
            stack.append((parent.add(painter.label(child)), child))
    return tree


class _Painter:
    """Turns items into styled text."""

    def __init__(
        self, flow: Flow, branches: Sequence[Branch], is_absolute: bool, width: int
    ) -> None:
        self.flow = flow
        self.is_absolute = is_absolute
        self.zero_ns: int = branches[0].lines[0].item.node["start_ns"]
        self.has_hosts = len({node["host"] for node in flow.nodes.values()}) > 1
        self.time_width = max(
            len(self._time(line.item.node)) for branch in walk(branches) for line in branch.lines
        )
        self.width = width

    def title(self) -> Text:
        start = self.flow.nodes[self.flow.start_key]
        text = f"{self.flow.start.kind} {self.flow.start.id}, {format_cell(start['label'])}"
        if not self.is_absolute:
            text += f"; times count from {format_epoch(self.zero_ns)}"
        return Text(text, style="bold")

    def label(self, branch: Branch) -> Table:
        # Two columns: wrapped lines stay to the right of the times.
        grid = Table.grid(padding=(0, _GAP))
        grid.add_column(justify="right", min_width=self.time_width, no_wrap=True, style="cyan")
        grid.add_column(overflow="fold")
        room = self.width - _INDENT * branch.depth - self.time_width - _GAP
        for line in branch.lines:
            node = line.item.node
            grid.add_row(self._time(node), self._text(line, room))
            # All messages of a topic end here: something may be missing.
            if node["otherwise_published"] and not line.is_reference:
                place, published = map(format_cell, (node["node"], node["otherwise_published"]))
                text = f"ends here; {place} publishes {published}: msgflow suggest links"
                grid.add_row("", Text(_bound(text, room), style="dim"))
        return grid

    def _text(self, line: Line, room: int) -> Text:
        item = line.item
        text = Text()
        if line.is_reference:
            return text.append(f"see [{item.number}]  {self._name(item, line.link)}", style="dim")
        if item.number is not None:
            text.append(f"[{item.number}] ")
        is_absent = item.node["kind"] == "subscription"
        text.append(self._name(item, line.link), style="yellow" if is_absent else "bold")
        for detail in self._details(item, line.link):
            text.append("  ").append(_bound(detail, room))
        start = self.flow.nodes[self.flow.start_key]
        if self.flow.direction == "both" and start in (item.node, item.take):
            text.append("  ◀", style="bold green")
        return text

    def _time(self, node: Row) -> str:
        start_ns = node["start_ns"]
        if start_ns is None:
            return "NA"
        if self.is_absolute:
            return format_epoch(start_ns)
        offset_ns = start_ns - self.zero_ns
        return f"{'+' if offset_ns >= 0 else ''}{format_duration(offset_ns)}"

    def _event(self, event: Row) -> str:
        """Return what the user's own code recorded in a callback instance, and when."""
        times = f" {event['event_count']} times, first" if event["event_count"] > 1 else ""
        at = self._time({"start_ns": event["first_ns"]})
        return f"{format_cell(event['name'])}{times} at {at}"

    def _name(self, item: Item, link: Row | None) -> str:
        node = item.node
        label, place = format_cell(node["label"]), format_cell(node["node"])
        if node["kind"] in ("publication", "request"):
            what = f"{'publishes' if node['kind'] == 'publication' else 'requests'} {label}"
            return f"{place}  {what}" if link is None or _is_alone(item) else what
        if node["kind"] == "response":
            return f"{place}  Client({label})"
        if node["kind"] == "callback_instance":
            return f"{place}  {label}"
        return f"{place}  Subscription({label})"

    def _details(self, item: Item, link: Row | None) -> list[str]:
        node = item.node
        if node["kind"] == "subscription":
            status = "unknown" if link is None else link["link_kind"].replace("_", " ")
            reason = _reason(link)
            return [status if reason == status else f"{status}: {reason}"]
        details = [
            _waits(edge) for _, edge in item.causes if edge["link_kind"] in ("transport", "service")
        ]
        if link is not None and link["link_kind"] not in _OF_EFFECT:
            details.append(_waits(link))
        requested = [edge for _, edge in item.causes if edge["link_kind"] == "callback"]
        details += _busy(node)
        for edge in [item.handover, *requested]:
            if edge is not None:
                details.append(f"take to callback {format_cell(edge['wait_ns'], 'ns')}")
        if node["kind"] in ("request", "response"):
            details += _sending(node)
        elif node["missing"] == "end":
            details.append("ran NA: never seen to end")
        elif node["kind"] == "callback_instance":
            details.append(f"ran {format_duration(node['end_ns'] - node['start_ns'])}")
            details += map(_call, node["calls"] or ())
        elif node["kind"] == "publication" and node["end_ns"] is not None:
            details.append(_publishing(node))
        details += map(self._event, node["user_events"] or ())
        for vertex in (item.take, node):
            if vertex is not None and vertex["missing"] == "copy":
                details.append("copy of a message within the process")
            if vertex is not None and vertex["missing"] in _NOT_SEEN.get(vertex["kind"], {}):
                why = f", {_reason(vertex)}" if vertex["missing"] == "publication" else ""
                details.append(f"NA: {_NOT_SEEN[vertex['kind']][vertex['missing']]}{why}")
        if node["kind"] not in ("publication", "request") or _is_alone(item):
            host = f" on {format_cell(node['host'])}" if self.has_hosts else ""
            details.append(f"thread {format_cell(node['thread'])}{host}")
        if node["symbol"]:
            details.append(format_cell(short_symbol(node["symbol"])))
        number = node["cut_count"] + (item.take["cut_count"] if item.take else 0)
        if number:
            details.append(f"… {number} more")
        return details


def _is_alone(item: Item) -> bool:
    """Tell whether its line has to name the node: no line before it does, but that of a client."""
    return all(cause.node["kind"] == "request" for cause, _ in item.causes)


def _bound(detail: str, room: int) -> str:
    """Return a detail that stays in one line; if too long, each number stays with its unit."""
    if cell_len(detail) <= room:
        return detail.replace(" ", _BOUND)
    return " ".join(word.replace(" ", _BOUND) for word in words(detail))


def _publishing(node: Row) -> str:
    """How long publish() took: the message is written after its last event."""
    least = format_duration(node["end_ns"] - node["start_ns"])
    if node["until_ns"] is None:
        return f"in {least} or more"
    return f"in {least} to {format_duration(node['until_ns'] - node['start_ns'])}"


def _waits(edge: Row) -> str:
    kind, wait_ns, stored_ns = str(edge["link_kind"]), edge["wait_ns"], edge["stored_ns"]
    text = "publish to take" if kind == "transport" else kind
    if stored_ns is not None and wait_ns is not None:
        text = f"stored {format_duration(stored_ns)}, then {text}"
        wait_ns -= stored_ns
    if wait_ns is not None:
        text += f" {format_duration(wait_ns)}"
    doubts = []
    if (edge["candidate_count"] or 1) > 1:
        doubts.append(f"one of {edge['candidate_count']} candidates")
    if edge["is_loss_affected"]:
        doubts.append("events were lost here")
    return f"{text} ({', '.join(doubts)})" if doubts else text


def _busy(node: Row) -> list[str]:
    """Return how long its executor was busy with other callbacks before the take."""
    least_ns, most_ns = node["busy_min_ns"], node["busy_max_ns"]
    if most_ns is None:
        return [f"in the queue at least {format_duration(least_ns)}"] if least_ns else []
    if most_ns == 0:
        return []
    if least_ns == most_ns:
        return [f"in the queue {format_duration(most_ns)}"]
    least = f"{format_duration(least_ns)} to" if least_ns else "up to"
    return [f"in the queue {least} {format_duration(most_ns)}"]


def _call(call: Row) -> str:
    """Return for which service it waited, and what of that was the queue and the callback."""
    server = "" if call["server"] is None else f" ({format_cell(call['server'])})"
    parts = [
        f"{name} {format_duration(call[column])}"
        for name, column in (("queue", "queue_ns"), ("callback", "served_ns"))
        if call[column] is not None
    ]
    text = f"service {format_cell(call['service'])}{server} {format_duration(call['waited_ns'])}"
    return f"{text}: {', '.join(parts)}" if parts else text


def _sending(node: Row) -> list[str]:
    if node["missing"] == "sending":
        return []
    if node["end_ns"] is None:
        return ["NA: it was not taken"]
    return [f"sending to take {format_duration(node['end_ns'] - node['start_ns'])}"]


def _reason(row: Row | None) -> str:
    reason = None if row is None else row["reason"]
    return "reason unknown" if reason is None else str(reason)
