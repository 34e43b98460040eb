"""Rows of packets, and checks of their times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.trace.model import EventBatch
from msgflow.trace.numpy_arrow import integers_to_arrow
from msgflow.trace.schemas import PACKET, PACKET_SCHEMA

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from msgflow.trace.ctf.packet_order import Entry, PacketEvents


class PacketRows:
    """Collects packets as they are read."""

    def __init__(self, report: Callable[[Entry, int, str], None]) -> None:
        """Call `report` for packets whose times contradict those of their events."""
        self._report = report
        self._rows: list[tuple[Any, ...]] = []

    def add(self, packets: Sequence[PacketEvents]) -> None:
        """Add packets that were read."""
        for packet in packets:
            entry = packet.entry
            if packet.falls_back:
                self._report(entry, 0, "time runs backward in the packet")
            if packet.first is not None and packet.first < entry.begin:
                self._report(entry, 0, "an event is earlier than the begin of its packet")
            last_ns = packet.last_ns if entry.stream.has_time else None
            self._rows.append(self._row(entry, packet.count, packet.last, last_ns))

    def take(self, most: int, number: int) -> Iterator[EventBatch]:
        """Yield and forget the rows of this round, at most `most` in a batch."""
        for begin in range(0, len(self._rows), most):
            rows = self._rows[begin : begin + most]
            columns = [
                integers_to_arrow(values, field.type)
                for field, values in zip(PACKET_SCHEMA, zip(*rows, strict=True), strict=True)
            ]
            batch = pa.RecordBatch.from_arrays(columns, schema=PACKET_SCHEMA)
            yield EventBatch(PACKET, batch, number)
        self._rows.clear()

    def _row(
        self, entry: Entry, count: int, last: int | None, last_ns: int | None
    ) -> tuple[Any, ...]:
        stream, header = entry.stream, entry.packet.header
        clock = stream.layout.stream.clock
        assert clock is not None
        begin_ns = None if header.begin is None else clock.to_ns(header.begin)
        end_ns = None
        if header.end is not None:
            # A crash leaves packets without an end; old tracers give one before the last event.
            latest = entry.begin if last is None else last
            end_ns = clock.to_ns(max(header.end, latest))
            is_late = bool(header.end) and last is not None and last > header.end
            if is_late and not events_may_follow_end(stream.layout.trace.environment):
                self._report(entry, 0, "an event is later than the end of its packet")
        return (
            stream.trace_index,
            stream.index,
            stream.class_id,
            stream.instance,
            header.cpu,
            entry.position,
            begin_ns,
            end_ns,
            last_ns,
            count,
            entry.discarded,
            entry.lost,
            entry.packet.header.sequence is not None,
        )


def events_may_follow_end(environment: Mapping[str, int | str]) -> bool:
    """Tell whether events may be later than the end of their packet.

    True of LTTng-UST before 2.11 and LTTng-modules before 2.9.13, 2.10.10 and 2.11.
    """
    version = tuple(
        value if isinstance(value := environment.get(f"tracer_{part}", 0), int) else 0
        for part in ("major", "minor", "patchlevel")
    )
    match environment.get("tracer_name"):
        case "lttng-ust":
            return version < (2, 11, 0)
        case "lttng-modules":
            return version < (2, 9, 13) or (2, 10, 0) <= version < (2, 10, 10)
        case _:
            return False
