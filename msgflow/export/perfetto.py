"""Perfetto trace of a run, for the Perfetto UI."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.sql.failure import format_errors
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    import duckdb

    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice

_SEQUENCE = 1
# Ids of things, by the code of the Perfetto slice.
_IDENTITIES = (
    "callback_instance_id",
    "publication_id",
    "take_id",
    "request_id",
    "request_id",
    "response_id",
    "response_id",
    "executor_id",
)
_LARGEST_INTEGER = 2**63 - 1
_SYMBOL = len(_IDENTITIES) + 1
_NUMBERS = ("candidate_count", "queue_ns", "served_ns")
_CATEGORIES = ("callback", "publication", "take", *["service"] * 4, "executor")


@dataclass(frozen=True)
class PerfettoTrace:
    """A trace that was written.

    Attributes:
        path: the file.
        run: what it is of.
        slices: callbacks, publications, takes, requests, responses and activities of executors.
        arrows: links between them.
        values: values of counters.
        gaps: stretches of a host in which something was not recorded.
        events: events of the user's own tracepoints.
        states: states of threads to the kernel, and stretches in which a core ran one of them.
        samples: samples of stacks.
    """

    path: Path
    run: Run
    slices: int
    arrows: int
    values: int
    gaps: int
    events: int
    states: int
    samples: int


def write_perfetto(connection: duckdb.DuckDBPyConnection, path: Path, part: Slice) -> PerfettoTrace:
    """Write a run as a Perfetto trace, event by event: memory never holds all of it."""
    run = part.one_run(connection, "a Perfetto trace")
    bindings = {"run_id": run.run_id, **part.window([run]).bindings}
    try:
        from perfetto.protos.perfetto.trace import perfetto_trace_pb2
        from perfetto.trace_builder.proto_builder import StreamingTraceProtoBuilder
    except ImportError:
        raise UsageError(
            "the package that writes Perfetto traces is not installed — perfetto",
            "pip install perfetto; or in a checkout of msgflow: uv tool install '.[perfetto]'",
        ) from None
    with format_errors(run.name), replacing(path) as temporary, temporary.open("wb") as file:
        builder = StreamingTraceProtoBuilder(file)
        writer = _Writer(builder, perfetto_trace_pb2, connection, run, bindings)
        writer.describe()
        slices, arrows = writer.slices()
        values = writer.values()
        gaps = writer.named_slices("perfetto_gap", "gap", {"lost_events": "event_count"})
        events = writer.user_events()
        noted = {name: name for name in ("cpu", "priority", "woken_by")}
        states = writer.named_slices("perfetto_state", "schedule", noted)
        samples = writer.samples()
    return PerfettoTrace(path, run, slices, arrows, values, gaps, events, states, samples)


@dataclass(frozen=True)
class _Writer:
    builder: Any
    packets: Any  # the module with the types of packets
    connection: duckdb.DuckDBPyConnection
    run: Run
    bindings: dict[str, Any]

    def rows(self, name: str) -> Iterator[dict[str, Any]]:
        return internal_sql().rows(self.connection, name, self.bindings)

    def describe(self) -> None:
        start_ns = self.run.start_ns or 0
        packet = self.builder.create_packet()
        # Timestamps count by the first clock; the second one lets the UI show points in time.
        for clock in ("BUILTIN_CLOCK_BOOTTIME", "BUILTIN_CLOCK_REALTIME"):
            number = self.packets.BuiltinClock.Value(clock)
            packet.clock_snapshot.clocks.add(clock_id=number, timestamp=start_ns)
        packet.trusted_packet_sequence_id = _SEQUENCE
        self.builder.write_packet(packet)
        for row in self.rows("perfetto_process"):
            track = self.track(row["track"])
            track.track_descriptor.process.pid = row["pid"]
            track.track_descriptor.process.process_name = row["name"]
            self.builder.write_packet(track)
        for row in self.rows("perfetto_thread"):
            track = self.track(row["track"], row["parent"])
            track.track_descriptor.thread.pid = row["pid"]
            track.track_descriptor.thread.tid = row["tid"]
            track.track_descriptor.thread.thread_name = row["name"]
            self.builder.write_packet(track)
            if row["has_states"]:
                track = self.track(row["state_track"], row["track"])
                track.track_descriptor.name = "executor"
                self.builder.write_packet(track)
        for row in self.rows("perfetto_counter"):
            track = self.track(row["track"], row["parent"])
            track.track_descriptor.name = row["name"]
            track.track_descriptor.counter.unit_name = row["unit"]
            self.builder.write_packet(track)
        self.names()

    def track(self, number: int, parent: int | None = None) -> Any:
        packet = self.builder.create_packet()
        packet.trusted_packet_sequence_id = _SEQUENCE
        packet.track_descriptor.uuid = number
        if parent is not None:
            packet.track_descriptor.parent_uuid = parent
        return packet

    def names(self) -> None:
        packet = self.builder.create_packet()
        packet.trusted_packet_sequence_id = _SEQUENCE
        packet.sequence_flags = self.packets.TracePacket.SEQ_INCREMENTAL_STATE_CLEARED
        for number, name in enumerate((*_IDENTITIES, "symbol", *_NUMBERS), start=1):
            packet.interned_data.debug_annotation_names.add(iid=number, name=name)
        for number, name in enumerate(_CATEGORIES, start=1):
            packet.interned_data.event_categories.add(iid=number, name=name)
        for row in self.rows("perfetto_name"):
            packet.interned_data.event_names.add(
                iid=row["id"] * 8 + row["code"] + 1, name=row["name"]
            )
        for row in self.rows("perfetto_symbol"):
            packet.interned_data.debug_annotation_string_values.add(
                iid=row["id"], str=row["name"].encode()
            )
        self.builder.write_packet(packet)

    def event(self, row: Mapping[str, Any], kind: int) -> Any:
        packet = self.builder.create_packet()
        packet.timestamp = row["at_ns"]
        packet.trusted_packet_sequence_id = _SEQUENCE
        packet.sequence_flags = self.packets.TracePacket.SEQ_NEEDS_INCREMENTAL_STATE
        packet.track_event.type = kind
        packet.track_event.track_uuid = row["track"]
        return packet

    def slices(self) -> tuple[int, int]:
        """Return how many slices were written, and how many arrows begin at them."""
        kind = self.packets.TrackEvent
        kinds = (kind.TYPE_SLICE_END, kind.TYPE_SLICE_BEGIN, kind.TYPE_INSTANT)
        slices = arrows = 0
        for row in self.rows("perfetto_slice"):
            packet = self.event(row, kinds[row["rank"]])
            if row["rank"]:
                slices += 1
                event = packet.track_event
                event.name_iid = row["name"]
                event.category_iids.append(row["code"] + 1)
                event.debug_annotations.add(name_iid=row["code"] + 1, int_value=row["id"])
                if row["symbol_id"] is not None:
                    event.debug_annotations.add(name_iid=_SYMBOL, string_value_iid=row["symbol_id"])
                for number, name in enumerate(_NUMBERS, start=_SYMBOL + 1):
                    if row[name] is not None:
                        event.debug_annotations.add(name_iid=number, int_value=row[name])
                if row["outgoing"]:
                    event.flow_ids.extend(row["outgoing"])
                    arrows += len(row["outgoing"])
                if row["incoming"]:
                    event.terminating_flow_ids.extend(row["incoming"])
            self.builder.write_packet(packet)
        return slices, arrows

    def values(self) -> int:
        count = 0
        for row in self.rows("perfetto_value"):
            packet = self.event(row, self.packets.TrackEvent.TYPE_COUNTER)
            packet.track_event.double_counter_value = row["value"]
            self.builder.write_packet(packet)
            count += 1
        return count

    def named_slices(self, query: str, category: str, noted: Mapping[str, str]) -> int:
        kind = self.packets.TrackEvent
        count = 0
        known = None
        for row in self.rows(query):
            if row["track"] != known:
                known = row["track"]
                track = self.track(known, row.get("parent"))
                track.track_descriptor.name = row["track_name"]
                self.builder.write_packet(track)
            begin = self.event(row | {"at_ns": row["start_ns"]}, kind.TYPE_SLICE_BEGIN)
            begin.track_event.name = row["name"]
            begin.track_event.categories.append(category)
            for name, column in noted.items():
                if row[column] is not None:
                    _add_argument(begin.track_event, name, row[column])
            self.builder.write_packet(begin)
            self.builder.write_packet(
                self.event(row | {"at_ns": row["end_ns"]}, kind.TYPE_SLICE_END)
            )
            count += 1
        return count

    def user_events(self) -> int:
        count = 0
        for row in self.rows("perfetto_event"):
            packet = self.event(row, self.packets.TrackEvent.TYPE_INSTANT)
            event = packet.track_event
            event.name = row["name"]
            event.categories.append("user_event")
            event.debug_annotations.add(name="user_event_id", int_value=row["id"])
            for name, value in json.loads(row["fields"]).items():
                _add_argument(event, name, value)
            self.builder.write_packet(packet)
            count += 1
        return count

    def samples(self) -> int:
        """Write samples of stacks, each stack and function once; return how many samples."""
        packet = self.builder.create_packet()
        packet.trusted_packet_sequence_id = _SEQUENCE
        counter = self.packets.PerfEvents.Counter
        timebase = packet.trace_packet_defaults.perf_sample_defaults.timebase
        timebase.counter = counter.SW_CPU_CLOCK
        interned = packet.interned_data
        for row in self.rows("perfetto_frame"):
            if row["id"] == row["file_id"]:
                interned.mapping_paths.add(iid=row["id"], str=row["file"].encode())
                interned.mappings.add(iid=row["id"], path_string_ids=[row["id"]])
            interned.function_names.add(iid=row["id"], str=row["name"].encode())
            interned.frames.add(
                iid=row["id"], function_name_id=row["id"], mapping_id=row["file_id"]
            )
        if not interned.frames:
            return 0
        for row in self.rows("perfetto_stack"):
            interned.callstacks.add(iid=row["stack_id"], frame_ids=row["frames"])
        self.builder.write_packet(packet)
        count = 0
        for row in self.rows("perfetto_sample"):
            packet = self.builder.create_packet()
            packet.timestamp = row["at_ns"]
            packet.trusted_packet_sequence_id = _SEQUENCE
            packet.sequence_flags = self.packets.TracePacket.SEQ_NEEDS_INCREMENTAL_STATE
            sample = packet.perf_sample
            sample.cpu, sample.pid, sample.tid = row["cpu"], row["pid"], row["tid"]
            sample.callstack_iid = row["stack_id"]
            self.builder.write_packet(packet)
            count += 1
        return count


def _add_argument(event: Any, name: str, value: Any) -> None:
    argument = event.debug_annotations.add(name=name)
    match value:
        case bool():
            argument.bool_value = value
        case int() if value > _LARGEST_INTEGER:
            argument.uint_value = value
        case int():
            argument.int_value = value
        case float():
            argument.double_value = value
        case str():
            argument.string_value = value
        case _:
            argument.legacy_json_value = json.dumps(value)
