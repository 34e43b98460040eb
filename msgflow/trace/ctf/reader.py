"""Reader of traces by msgflow's own decoder."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

from msgflow.errors import TraceError
from msgflow.trace.archive import Unpacked
from msgflow.trace.ctf import json_metadata, tsdl
from msgflow.trace.ctf.batches import Iteration
from msgflow.trace.ctf.declarations import Clock, TraceClass
from msgflow.trace.ctf.event_positions import BEYOND_END
from msgflow.trace.ctf.field_types import MetadataError
from msgflow.trace.ctf.losses import Continuation, LossCounter
from msgflow.trace.ctf.packet_header import HeaderReader
from msgflow.trace.ctf.packet_index import orphans
from msgflow.trace.ctf.packet_order import Entry, entries_of
from msgflow.trace.ctf.packet_times import begins_of
from msgflow.trace.ctf.packets import Packet, Stream, streams_of
from msgflow.trace.ctf.stream_layout import StreamLayout
from msgflow.trace.ctf.trace_info import corrected, describe
from msgflow.trace.discovery import irregular_files, stream_files
from msgflow.trace.metadata_frame import FILE_NAME, MetadataKind, text_of
from msgflow.trace.model import Damage, TraceInfo, TraceLocation
from msgflow.trace.regular_file import unreadable_error
from msgflow.trace.time_base import on_one_base
from msgflow.trace.trace_set import Batches, Report, TraceSet, Wanted


class CtfTraceSet(TraceSet):
    """Traces read by msgflow itself."""

    def __init__(
        self,
        locations: Sequence[TraceLocation],
        unpacked: Unpacked,
        *,
        strict: bool = False,
        after: Continuation | None = None,
    ) -> None:
        """Read the metadata and find the packets; no event is read yet.

        `strict` ends at the first damage. `after` holds what was read before of the same
        recordings, and takes these parts in. They can be read only once then.
        """
        super().__init__(unpacked)
        self._strict = strict
        self._layouts: list[StreamLayout] = []
        self._streams: list[Stream] = []
        self._begins: dict[Packet, tuple[int, int]] | None = None
        self._found_early: list[Damage] = []
        self._losses = None if after is None else after.losses
        self.traces: tuple[TraceInfo, ...] = on_one_base(
            [self._open(location, index) for index, location in enumerate(locations)],
            {} if after is None else after.clock_offsets,
        )
        for layout in self._layouts:
            layout.stream.clock = corrected(layout.stream.clock, self.traces[layout.trace_index])
        self._found_early = list(self.damages)

    def _open(self, location: TraceLocation, index: int) -> TraceInfo:
        path = location.path
        try:
            declared = read_metadata(path)
        except OSError as error:
            raise unreadable_error(error, path) from error
        if not location.size_bytes:
            return TraceInfo(index, self.unpacked.shown(path))
        if all(stream_class.clock is None for stream_class in declared.streams.values()):
            for stream_class in declared.streams.values():
                # Its packets are ordered by numbers in place of times.
                stream_class.clock, stream_class.has_time = Clock(), False
        layouts = {}
        for stream_class in declared.streams.values():
            number = sum(len(layout.classes) for layout in self._layouts)
            layout = layouts[stream_class.id] = StreamLayout(index, declared, stream_class, number)
            self._layouts.append(layout)

        def report(file: Path, position: int, offset: int, message: str) -> None:
            self._report(Damage(index, self.unpacked.shown(file), position, offset, message))

        for file in location.strays:
            report(file, 0, 0, "a stream without `metadata`, which is missing or renamed: left out")
        for note in declared.notes:
            report(path / FILE_NAME, 0, 0, note)
        try:
            for file, kind in irregular_files(path):
                report(file, 0, 0, f"{kind}, no file: left out")
            for file in orphans(path):
                report(file, 0, 0, f"the stream {file.stem} is missing, only its index is there")
            streams = streams_of(stream_files(path), HeaderReader(declared), layouts, report)
        except MetadataError as error:
            raise _damaged_error(path, str(error)) from error
        except OSError as error:
            raise unreadable_error(error, path) from error
        for stream in streams:
            stream.rank = len(self._streams)
            self._streams.append(stream)
        return describe(declared, self.unpacked.shown(path), index, streams)

    def _batches(self, wanted: Wanted, progress: Report | None, batch_rows: int) -> Batches:
        self.damages = list(self._found_early)
        if self._begins is None:
            # Packets without times have a number in place of the clock's value, and of the time.
            timeless = (s.packets for s in self._streams if not s.has_time)
            numbered = enumerate(itertools.chain.from_iterable(timeless))
            self._begins = {packet: (number, number) for number, packet in numbered}
            for stream in self._streams:
                if stream.has_time:
                    self._begins |= begins_of(stream)
        counter = LossCounter() if self._losses is None else self._losses
        packets, self.duplicate_packet_count, self.repeated_packet_counts = entries_of(
            self._streams, self.traces, self._begins, counter, self._report_in_packet
        )
        iteration = Iteration(
            self._layouts, packets, wanted, progress, batch_rows, self._report_in_packet
        )
        try:
            yield from iteration.run()
        finally:
            self.event_counts = iteration.event_counts()
            self.damages.sort(key=lambda damage: (damage.trace_index, damage.file, damage.offset))

    def _report_in_packet(self, entry: Entry, offset: int, message: str) -> None:
        packet = entry.packet
        if packet.is_cut and message == BEYOND_END:
            return  # reported when the packet was found
        file, at = self.unpacked.shown(packet.path), packet.offset + offset
        self._report(Damage(entry.stream.trace_index, file, packet.number, at, message))

    def _report(self, damage: Damage) -> None:
        if self._strict:
            raise TraceError(
                f"{damage.message} — {damage.file}, packet {damage.position}, "
                f"offset {damage.offset}",
                hint="copy it again from where it was recorded, or read it without --strict",
            )
        self.damages.append(damage)


def read_metadata(directory: Path) -> TraceClass:
    """Read what the trace in this directory declares."""
    kind, content = text_of(directory)
    text = content.decode("utf-8", "replace")
    try:
        return json_metadata.parse(text) if kind is MetadataKind.JSON else tsdl.parse(text)
    except (MetadataError, RecursionError) as error:
        reason = str(error) if isinstance(error, MetadataError) else "too deeply nested"
        raise _damaged_error(directory, reason) from error


def _damaged_error(directory: Path, reason: str) -> TraceError:
    """Return the error for metadata that makes no sense."""
    return TraceError(
        f"the trace's `metadata` is damaged or incomplete: {reason} — {directory}",
        hint="copy it again from where it was recorded",
    )
