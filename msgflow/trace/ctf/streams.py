"""Data streams of a trace: the packets of each in order, from all its files."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from msgflow.trace.ctf.packet_header import HeaderReader
    from msgflow.trace.ctf.packets import Packet
    from msgflow.trace.ctf.stream_layout import StreamLayout

from msgflow.trace.ctf.packets import packets_of


@dataclass(eq=False)
class Stream:
    """One data stream: the packets of one buffer, from all its files."""

    layout: StreamLayout
    instance: int  # its number in its class
    packets: list[Packet] = field(default_factory=list)  # in order of time
    index: int = -1  # its place among the streams of the trace, by class and instance
    rank: int = -1  # its place among the streams of all traces

    @property
    def class_id(self) -> int:
        """Id of its stream class."""
        return self.layout.stream.id

    @property
    def has_time(self) -> bool:
        """Its events have times."""
        return self.layout.stream.has_time

    @property
    def trace_index(self) -> int:
        """Place of its trace in the set."""
        return self.layout.trace_index


def streams_of(
    files: Sequence[Path],
    reader: HeaderReader,
    layouts: dict[int, StreamLayout],
    report: Callable[[Path, int, int, str], None],
) -> list[Stream]:
    """Return the streams of a trace, in order of class and instance.

    A stream may have several files (rotated or limited in size). Packets that do not name their
    stream belong to a stream of their file alone, numbered in order of the file names.
    """
    streams: dict[tuple[int, int | None, Path | None], Stream] = {}
    for path in files:
        for packet in packets_of(path, reader, report):
            header = packet.header
            own_file = path if header.instance is None else None
            key = (header.stream.id, header.instance, own_file)
            if key not in streams:
                unnamed = sum(known[2] is not None for known in streams)
                instance = unnamed if header.instance is None else header.instance
                streams[key] = Stream(layouts[header.stream.id], instance)
            streams[key].packets.append(packet)
    for stream in streams.values():
        if all(packet.header.begin is not None for packet in stream.packets):
            stream.packets.sort(
                key=lambda packet: (packet.header.begin, packet.header.sequence or 0)
            )
    ordered = sorted(streams.values(), key=lambda stream: (stream.class_id, stream.instance))
    for index, stream in enumerate(ordered):
        stream.index = index
    return ordered
