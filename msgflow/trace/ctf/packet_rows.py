"""Rows of packets, and checks of their times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.trace.model import PACKET, EventBatch
from msgflow.trace.numpy_arrow import integers_to_arrow
from msgflow.trace.schemas import PACKET_SCHEMA

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from msgflow.trace.ctf.packet_order import Entry, PacketEvents


def packet_batches(
    packets: Sequence[PacketEvents],
    most: int,
    number: int,
    report: Callable[[Entry, int, str], None],
) -> Iterator[EventBatch]:
    """Yield the rows of packets that were read in a round, at most `most` in a batch.

    `report` is called for packets whose times contradict those of their events.
    """
    rows = [_row(packet, report) for packet in packets]
    for begin in range(0, len(rows), most):
        columns = [
            integers_to_arrow(values, field.type)
            for field, values in zip(
                PACKET_SCHEMA, zip(*rows[begin : begin + most], strict=True), strict=True
            )
        ]
        batch = pa.RecordBatch.from_arrays(columns, schema=PACKET_SCHEMA)
        yield EventBatch(PACKET, batch, number)


def _row(packet: PacketEvents, report: Callable[[Entry, int, str], None]) -> tuple[Any, ...]:
    entry, stream = packet.entry, packet.entry.stream
    header, last = entry.packet.header, packet.last
    if packet.falls_back:
        report(entry, 0, "time runs backward in the packet")
    if packet.first is not None and packet.first < entry.begin:
        report(entry, 0, "an event is earlier than the begin of its packet")
    clock = stream.layout.stream.clock
    assert clock is not None
    end_ns = None
    if header.end is not None:
        # A crash leaves packets without an end; old tracers give one before the last event.
        end_ns = clock.to_ns(max(header.end, entry.begin if last is None else last))
        is_late = bool(header.end) and last is not None and last > header.end
        if is_late and not _events_may_follow_end(stream.layout.trace.environment):
            report(entry, 0, "an event is later than the end of its packet")
    return (
        stream.trace_index,
        stream.index,
        stream.class_id,
        stream.instance,
        header.cpu,
        entry.position,
        None if header.begin is None else clock.to_ns(header.begin),
        end_ns,
        packet.last_ns if stream.has_time else None,
        packet.count,
        entry.discarded,
        entry.lost,
        header.sequence is not None,
    )


def _events_may_follow_end(environment: Mapping[str, int | str]) -> bool:
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
