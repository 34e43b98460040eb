"""Reader on Babeltrace 2: simple, slow and complete, the reference for our own decoder."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import itemgetter
from pathlib import Path
from typing import Any

import pyarrow as pa

from msgflow.errors import TraceError
from msgflow.trace import bt2_library, columns
from msgflow.trace.archive import Unpacked
from msgflow.trace.bt2_fields import schema_of, value_of
from msgflow.trace.columns import COMMON_SCHEMA, PACKET_SCHEMA
from msgflow.trace.ctf.declarations import GIGA, Clock
from msgflow.trace.ctf.packet_index import first_counter
from msgflow.trace.ctf.trace_info import description
from msgflow.trace.metadata_frame import MetadataKind, text_of
from msgflow.trace.model import PACKET, EventBatch, Progress, TraceInfo, TraceLocation
from msgflow.trace.time_base import on_one_base
from msgflow.trace.trace_set import Batches, Report, TraceSet, Wanted

# Babeltrace orders by times that it rounds, where a clock does not count nanoseconds.
_ROUNDING_NS = 1000
_CONTEXT = [COMMON_SCHEMA.field(name) for name in ("vpid", "vtid", "procname", "pid_ns")]
_QUOTED_PATH = re.compile(r"[`'](/[^`']+)[`']")
_ADDRESS = re.compile(r"[\w-]*addr=0x[0-9a-f]+,?")


class Bt2TraceSet(TraceSet):
    """Traces read through Babeltrace 2."""

    def __init__(self, locations: Sequence[TraceLocation], unpacked: Unpacked) -> None:
        """Describe the traces; raises TraceError where bt2 is missing or cannot open one."""
        super().__init__(unpacked)
        self._bt2 = bt2_library.load()
        described = [describe(self._bt2, at.path, index) for index, at in enumerate(locations)]
        self._located = on_one_base([info for info, _ in described], {})
        self.traces = tuple(replace(info, path=unpacked.shown(info.path)) for info in self._located)
        self._declared = columns.merged_schemas(e for _, events in described for e in events)

    def _batches(self, wanted: Wanted, progress: Report | None, batch_rows: int) -> Batches:
        reading = _Reading(
            self._bt2, self._located, columns.complete_schemas(wanted, self._declared)
        )
        try:
            yield from reading.batches(progress, batch_rows)
        finally:
            self.event_counts = dict(sorted(reading.counts.items()))
            self.duplicate_packet_count = reading.duplicates


@dataclass
class _Stream:
    """A data stream; its packet is a row of `PACKET_SCHEMA`, None where it is a copy."""

    key: tuple[int, int, int]  # trace, stream class, stream instance
    recording: tuple[Any, ...]  # equal in all directories of a recording
    clock: Clock
    index: int = 0
    packet: dict[str, Any] | None = None
    packet_count: int = 0
    discards: Any = None  # the message that reports them
    lost_packets: int | None = 0


@dataclass
class _Reading:
    """One pass over all messages."""

    bt2: Any
    traces: Sequence[TraceInfo]
    payloads: Mapping[str, pa.Schema]
    counts: Counter[tuple[int, str]] = field(default_factory=Counter)
    duplicates: int = 0

    def __post_init__(self) -> None:
        self._streams: dict[int, _Stream] = {}
        self._first_traces: dict[Any, int] = {}
        # Of lost events, by recording: they go on in its next directory.
        self._counters: Counter[tuple[Any, ...]] = Counter()
        self._simultaneous: list[Any] = []
        self._paths: dict[int, list[tuple[bool, Any, Any]]] = {}
        self._rows: dict[str, list[list[Any]]] = {}
        self._packets: list[dict[str, Any]] = []
        self._round = self._event_count = self._time_ns = self._slack_ns = 0
        self._begin_ns = min((info.begin_ns for info in self.traces if info.begin_ns), default=0)
        self._end_ns = max((info.end_ns for info in self.traces if info.end_ns), default=0)

    def batches(self, progress: Report | None, batch_rows: int) -> Iterator[EventBatch]:
        places = [(trace.path, trace.clock_correction_ns) for trace in self.traces]
        horizon_ns = flushed = 0
        try:
            for message in messages(self.bt2, places):
                stream, time_ns = self._place(message)
                if time_ns is not None and time_ns > horizon_ns:
                    self._number()
                    if self._event_count >= flushed + batch_rows:
                        yield from self._flush(progress)
                        flushed = self._event_count
                horizon_ns = max(horizon_ns, (time_ns or 0) + self._slack_ns)
                self._take(message, stream, time_ns)
        except TraceError as error:
            yield from self._flush(progress)
            read = f"{self._event_count} events were read before"
            raise TraceError(f"{error.message}; {read}", error.hint) from error
        self._number()
        self._time_ns = self._end_ns
        yield from self._flush(progress)

    def _place(self, message: Any) -> tuple[_Stream, int | None]:
        """Return the stream and the time of a message; None if it has no time."""
        bt2, kind = self.bt2, type(message)
        has_packet = kind in (bt2._PacketBeginningMessageConst, bt2._PacketEndMessageConst)
        has_time = kind is bt2._EventMessageConst
        stream = (message.event if has_time else message.packet if has_packet else message).stream
        if has_packet:
            end = "end" if kind is bt2._PacketEndMessageConst else "beginning"
            has_time = getattr(stream.cls, f"packets_have_{end}_default_clock_snapshot")
        known = self._streams.get(stream.addr) or self._add(stream)
        return known, known.clock.to_ns(message.default_clock_snapshot.value) if has_time else None

    def _add(self, stream: Any) -> _Stream:
        # Babeltrace puts the host name and a slash before the name of the trace.
        trace = self.traces[int(stream.trace.name.rpartition("/")[2])]
        ids, clock = (stream.cls.id, stream.id), clock_of(stream.cls.default_clock_class)
        recording = (trace.uuid or trace.path, *ids)
        added = self._streams[stream.addr] = _Stream((trace.index, *ids), recording, clock)
        if clock.frequency != GIGA:
            self._slack_ns = _ROUNDING_NS
        of_trace = [known for known in self._streams.values() if known.key[0] == trace.index]
        for index, known in enumerate(sorted(of_trace, key=lambda stream: stream.key)):
            known.index = index
        return added

    def _take(self, message: Any, stream: _Stream, time_ns: int | None) -> None:
        bt2, kind, packet = self.bt2, type(message), stream.packet
        if kind is bt2._PacketBeginningMessageConst:
            stream.packet = self._begin_packet(message.packet.context_field or {}, stream, time_ns)
            stream.discards, stream.lost_packets = None, 0
        elif kind is bt2._DiscardedEventsMessageConst:
            stream.discards = message
        elif kind is bt2._DiscardedPacketsMessageConst:
            stream.lost_packets = message.count
        elif kind is bt2._PacketEndMessageConst and packet is not None:
            self._packets.append(packet | {"end_ns": time_ns})
        elif kind is bt2._EventMessageConst and packet is not None:
            packet["event_count"] += 1
            packet["last_event_ns"] = time_ns
            self._simultaneous.append((time_ns, stream.key, packet["cpu_id"], message.event))

    def _begin_packet(self, context: Any, stream: _Stream, begin_ns: int | None) -> Any:
        """Return the row of a packet, None for a copy."""
        trace, *stream_id = stream.key
        # Copies begin at the same time: Babeltrace delivers that of the first trace first.
        first_trace = self._first_traces.setdefault((stream.recording, begin_ns), trace)
        if begin_ns is not None and first_trace != trace:
            self.duplicates += 1
            return None
        stream.packet_count += 1
        discarded = 0 if stream.discards is None else self._discarded(stream)
        if stream.lost_packets != 0 and discarded != 0:
            discarded = None  # nothing tells which of them were in the lost packets
        return {
            "trace_index": trace,
            "stream_index": stream.index,
            "stream_class_id": stream_id[0],
            "stream_instance_id": stream_id[1],
            "cpu_id": int(context["cpu_id"]) if "cpu_id" in context else None,
            "position": stream.packet_count - 1,
            "begin_ns": begin_ns,
            "last_event_ns": None,
            "event_count": 0,
            "discarded_event_count": discarded,
            "lost_packet_count": stream.lost_packets,
            "is_numbered": False,
        }

    def _discarded(self, stream: _Stream) -> int | None:
        """Return how many events were lost before a packet; None where nothing tells it."""
        before = self._counters[stream.recording]
        lost: int | None = stream.discards.count
        # Of the first packet of a directory, Babeltrace does not tell it.
        if lost is None:
            trace, class_id, instance_id = stream.key
            counter = first_counter(self.traces[trace].path, class_id, instance_id)
            if counter is None:
                return None
            lost = counter - before if counter >= before else counter
            before = counter - lost
        self._counters[stream.recording] = before + lost
        return lost

    def _number(self) -> None:
        """Number the events of one time in order of trace and stream, and keep what is wanted."""
        held, self._simultaneous = sorted(self._simultaneous, key=itemgetter(0, 1)), []
        for time_ns, (trace_index, *_), cpu_id, event in held:
            name = event.name or ""
            if name in self.payloads:
                row = [self._event_count, time_ns, trace_index, cpu_id, *self._values(event)]
                self._rows.setdefault(name, []).append(row)
            self.counts[trace_index, name] += 1
            self._event_count += 1
            self._time_ns = time_ns

    def _values(self, event: Any) -> list[Any]:
        bt2, cls = self.bt2, event.cls
        if cls.addr not in self._paths:
            fields = [*_CONTEXT, *self.payloads[cls.name or ""]]
            in_context = columns.paths_of(fields, context_of(bt2, cls))
            in_payload = columns.paths_of(fields, schema_of(bt2, cls.payload_field_class))
            is_context = [
                place < len(_CONTEXT) or columns.is_of_context(field)
                for place, field in enumerate(fields)
            ]
            self._paths[cls.addr] = list(zip(is_context, in_context, in_payload, strict=True))
        context = value_of(bt2, event.specific_context_field) or {}
        context |= value_of(bt2, event.common_context_field) or {}
        payload = value_of(bt2, event.payload_field)
        values = [
            columns.first_inner_value(context, of_context)
            if is_context
            else columns.first_inner_value(payload, of_payload)
            for is_context, of_context, of_payload in self._paths[cls.addr]
        ]
        values[:2] = [-1 if value is None else value for value in values[:2]]
        return values

    def _flush(self, progress: Report | None) -> Iterator[EventBatch]:
        self._number()
        for name, rows in self._rows.items():
            schema = pa.schema([*COMMON_SCHEMA, *self.payloads[name]])
            yield EventBatch(name, columns.batch_of(rows, schema), self._round)
        if self._packets:
            batch = pa.RecordBatch.from_pylist(self._packets, schema=PACKET_SCHEMA)
            yield EventBatch(PACKET, batch, self._round)
        self._rows, self._packets = {}, []
        self._round += 1
        if progress is not None:
            fraction = (self._time_ns - self._begin_ns) / ((self._end_ns - self._begin_ns) or 1)
            progress(Progress(self._event_count, min(max(fraction, 0.0), 1.0), self._time_ns))


def messages(bt2: Any, traces: Sequence[tuple[Path, int]]) -> Iterator[Any]:
    """Yield the messages of traces; each is a directory and a correction of its clock [ns].

    A directory has a source of its own: one source would merge directories of one trace uuid.
    The name of a trace object ends with the place of the trace in `traces`.
    """
    source = bt2.ComponentSpec.from_named_plugin_and_component_class
    parameters = [parameters_of(path, place, ns) for place, (path, ns) in enumerate(traces)]
    try:
        yield from bt2.TraceCollectionMessageIterator([source("ctf", "fs", p) for p in parameters])
    except bt2._Error as error:
        # Babeltrace turns an exception that Python raised in between into text.
        if "KeyboardInterrupt" in str(error):
            raise KeyboardInterrupt from None
        # The components are named fs, fs-1, fs-2 and so on.
        names = [getattr(cause, "component_name", None) or "" for cause in error]
        places = [int(name[3:] or 0) for name in names if re.fullmatch(r"fs(-\d+)?", name)]
        path = traces[places[0]][0] if places else "TRACE"
        cause = " ".join(_ADDRESS.sub("", error[0].message).split()).rstrip(".,: ")
        named = [match[1] for each in error for match in _QUOTED_PATH.finditer(each.message)]
        raise TraceError(
            f"the trace is damaged or incomplete: {cause} — {named[0] if named else path}",
            hint="copy it again from where it was recorded;"
            f" babeltrace2 {shlex.quote(str(path))} says more",
        ) from error


def parameters_of(path: Path, place: int = 0, correction_ns: int = 0) -> dict[str, Any]:
    """Return the parameters with which `source.ctf.fs` reads a trace; see `messages`.

    The clocks are said to count from the epoch, which LTTng's do: Babeltrace orders traces of
    several clocks only then.
    """
    return {
        "inputs": [str(path)],
        "trace-name": f"{place:09}",
        "clock-class-offset-ns": correction_ns,
        "force-clock-class-origin-unix-epoch": True,
    }


def describe(bt2: Any, path: Path, index: int) -> tuple[TraceInfo, list[Any]]:
    """Describe one trace, with names and payload schemas of its events."""
    if text_of(path)[0] is MetadataKind.JSON and bt2.__version__ < "2.1":
        raise TraceError(
            "the trace is CTF 2, which needs babeltrace2 2.1 or newer, here is "
            f"{bt2.__version__} — {path}",
            hint="record with `lttng create --trace-format=ctf-1.8`, or install a newer "
            "python3-bt2",
        )
    first = next(messages(bt2, [(path, 0)]), None)
    if first is None:
        return TraceInfo(index, path), []
    trace = first.stream.trace
    streams = list(trace.cls.values())
    events = [event for stream in streams for event in stream.values()]
    if any(stream.default_clock_class is None for stream in streams):
        raise TraceError(
            f"the events have no time stamps — {path}", hint="record with LTTng or ros2_tracing"
        )
    # On a damaged trace this query ends the process: it comes after the trace could be opened.
    source = bt2.find_plugin("ctf").source_component_classes["fs"]
    query = bt2.QueryExecutor(source, "babeltrace.trace-infos", parameters_of(path))
    found = [stream for each in query.query() for stream in each["stream-infos"]]
    ranges = [stream["range-ns"] for stream in found if "range-ns" in stream]
    info = description(
        path,
        index,
        uuid=None if trace.uuid is None else str(trace.uuid),
        environment=dict(trace.environment),
        clock=clock_of(streams[0].default_clock_class),
        begins=[int(span["begin"]) for span in ranges],
        ends=[int(span["end"]) for span in ranges],
        events=[(event.name or "", {*context_of(bt2, event).names}) for event in events],
    )
    return info, [(event.name or "", schema_of(bt2, event.payload_field_class)) for event in events]


def context_of(bt2: Any, event_class: Any) -> pa.Schema:
    """Return the contexts of an event class; what all events of the stream have comes last."""
    specific = schema_of(bt2, event_class.specific_context_field_class)
    common = schema_of(bt2, event_class.stream_class.event_common_context_field_class)
    return pa.schema([*specific, *common])


def clock_of(clock: Any) -> Clock:
    """Return a clock class of Babeltrace, which itself rounds times, as one of ours."""
    uuid = None if clock.uuid is None else str(clock.uuid)
    return Clock(clock.frequency, clock.offset.seconds, clock.offset.cycles, clock.name, uuid)
