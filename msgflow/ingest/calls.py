"""Calls of several layers, of which each is an event: those that are staged as one row if possible.

Nearly every message is published and taken, and nearly every callback run, without anything in
between. Such calls are put together where all of their events are in memory anyway, so that the
database need not join them. Of each layer, `raw.<table>_apart` has the events that are in no whole
call, and `raw.<table>` is a view of all.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING

import duckdb

from msgflow.ingest.catalogue import COMMON_COLUMNS, Origin, Predecessor, load

if TYPE_CHECKING:
    from collections.abc import Mapping

    from msgflow.ingest.catalogue import Tracepoint

TAKEN_APART = "staging.taken_apart"
"""The object of the model that tells which calls have to be taken apart again."""

_CONTEXT = tuple(name for name, _ in COMMON_COLUMNS[2:])


@dataclass(frozen=True)
class Call:
    """A kind of call.

    Attributes:
        name: of the call.
        names: tracepoints of the layers, in their order.
        sequence: of the thread; in it each layer directly follows the one before.
        same: the field that has the same value in all layers.
        not_after: tracepoint of an event that may belong to the call as well, if the first layer
            directly follows it; None if there is none.
    """

    name: str
    names: tuple[str, ...]
    sequence: str
    same: str
    not_after: str | None = None

    @property
    def table(self) -> str:
        """The staging table with one row per whole call."""
        return f"whole_{self.name}"

    @property
    def follows(self) -> str:
        """The column of each layer with the event that it directly follows."""
        return Predecessor(self.sequence, Origin.EVENT_ID).column

    @cached_property
    def layers(self) -> tuple[Tracepoint, ...]:
        """The layers in their order."""
        return tuple(load().tracepoints[name] for name in self.names)

    @cached_property
    def shared(self) -> tuple[str, ...]:
        """The columns that have the same value in all layers of a whole call.

        With nothing of its sequence in between, there is nothing of a part of it either.
        """
        inside = [
            before.column
            for before in self.layers[0].predecessors
            if before.sequence != self.sequence
            and all(before in layer.predecessors for layer in self.layers)
            and all(
                self.sequence in each.sequences
                for each in load().of_threads
                if before.sequence in each.sequences
            )
        ]
        return (*_CONTEXT, self.same, *inside)

    def column_of(self, layer: int, column: str) -> str:
        """Return the column of `table` that holds a column of the staging table of a layer."""
        if column in self.shared:
            return column
        if layer and column == self.follows:
            return f"{self.layers[layer - 1].event}_event_id"
        return f"{self.layers[layer].event}_{column}"

    @cached_property
    def columns(self) -> Mapping[str, tuple[int, str]]:
        """The columns of `table`, each with the layer and its column that it is taken from."""
        found: dict[str, tuple[int, str]] = {}
        for place, layer in enumerate(self.layers):
            for column, _ in layer.columns(load().labels):
                found.setdefault(self.column_of(place, column), (place, column))
        return found


CALLS = (
    Call(
        "publication",
        ("ros2:rclcpp_publish", "ros2:rcl_publish", "ros2:rmw_publish"),
        sequence="call",
        same="message",
    ),
    Call(
        "rcl_publication",
        ("ros2:rcl_publish", "ros2:rmw_publish"),
        sequence="call",
        same="message",
        not_after="ros2:rclcpp_publish",
    ),
    Call(
        "take",
        ("ros2:rmw_take", "ros2:rcl_take", "ros2:rclcpp_take"),
        sequence="call",
        same="message",
        not_after="dds:read",
    ),
    Call(
        "callback",
        ("ros2:callback_start", "ros2:callback_end"),
        sequence="callback",
        same="callback",
    ),
)


@cache
def parts() -> Mapping[str, tuple[str, ...]]:
    """Return the views of `raw`, each with the tables that it is made of."""
    return {
        layer.table: (apart(layer), *(call.table for call in CALLS if layer in call.layers))
        for layer in layers()
    }


@cache
def layers() -> tuple[Tracepoint, ...]:
    """Return the tracepoints that are layers of calls."""
    return tuple(dict.fromkeys(layer for call in CALLS for layer in call.layers))


@cache
def apart(tracepoint: Tracepoint) -> str:
    """Return the table of `raw` that events of a tracepoint go to which are in no whole call."""
    return f"{tracepoint.table}_apart" if tracepoint in layers() else tracepoint.table


def statements() -> tuple[str, ...]:
    """Return what creates the tables of whole calls, and the views of their layers, in `raw`."""
    return (*map(_table, CALLS), *map(_view, layers()))


def take_apart(con: duckdb.DuckDBPyConnection, call: Call) -> None:
    """Move the events of those calls that `staging.taken_apart` tells of, all of them or none."""
    last = call.column_of(len(call.layers) - 1, "event_id")
    chosen = (
        f"FROM raw.{call.table} WHERE {last} IN (SELECT event_id FROM {TAKEN_APART}) "
        f"OR thread_index IN (SELECT thread_index FROM {TAKEN_APART})"
    )
    con.begin()
    try:
        for place, layer in enumerate(call.layers):
            con.execute(f"INSERT INTO raw.{apart(layer)} SELECT {_columns(call, place)} {chosen}")
        con.execute(f"DELETE {chosen}")
        con.commit()
    except BaseException:
        with contextlib.suppress(duckdb.Error):  # the transaction may have ended by itself
            con.rollback()
        raise


def _columns(call: Call, place: int) -> str:
    return ", ".join(
        f"{call.column_of(place, column)} AS {column}"
        for column, _ in call.layers[place].columns(load().labels)
    )


def _table(call: Call) -> str:
    labels = load().labels
    types = [dict(layer.columns(labels)) for layer in call.layers]
    columns = ", ".join(
        f"{name} {types[layer][column]}" for name, (layer, column) in call.columns.items()
    )
    return f"CREATE TABLE raw.{call.table} ({columns})"


def _view(layer: Tracepoint) -> str:
    whole = (
        f" UNION ALL SELECT {_columns(call, call.layers.index(layer))} FROM raw.{call.table}"
        for call in CALLS
        if layer in call.layers
    )
    return f"CREATE VIEW raw.{layer.table} AS FROM raw.{apart(layer)}{''.join(whole)}"
