"""Vertices and edges of the flow of one message."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.query.flow import Start
    from msgflow.run.choice import Run

Key = tuple[str, int]
Row = dict[str, Any]

_LINK = ("link_kind", "wait_ns", "stored_ns", "candidate_count", "is_loss_affected")
_NODE = (
    "kind",
    "id",
    "depth",
    "start_ns",
    "end_ns",
    "node",
    "label",
    "topic_name",
    "symbol",
    "thread",
    "host",
    "busy_min_ns",
    "busy_max_ns",
    "until_ns",
    "user_events",
    "otherwise_published",
)
_STATE = ("missing", "reason", "cut_count", "internal_count")
# What a subscription did not take has such a vertex, and the status of the message as its link.
NOT_TAKEN = "subscription"


@dataclass(frozen=True, repr=False)
class FlowVertices:
    """The causes and effects of one message. Times are integers in nanoseconds.

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
            how long a message was stored until its subscription existed (stored_ns).
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
            # The edge says that a message was not taken: the subscription may miss several.
            state = dict.fromkeys(_STATE) if row["kind"] == NOT_TAKEN else row
            node = {name: row[name] for name in _NODE} | {name: state[name] for name in _STATE}
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
