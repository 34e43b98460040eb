"""Perfetto trace of a run, for the Perfetto UI."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.sql.failure import format_errors
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice

_SEQUENCE = 1
_LARGEST_INTEGER = 2**63 - 1


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
    """Writes packets; a message inside of one is a dictionary, in which None stands for nothing."""

    builder: Any
    types: Any  # the module with the types of packets
    connection: duckdb.DuckDBPyConnection
    run: Run
    bindings: dict[str, Any]

    def rows(self, name: str) -> Iterator[dict[str, Any]]:
        return internal_sql().rows(self.connection, name, self.bindings)

    def write(self, **fields: Any) -> None:
        packet = self.types.TracePacket(trusted_packet_sequence_id=_SEQUENCE, **fields)
        self.builder.write_packet(packet)

    def write_at(self, time_ns: int, **fields: Any) -> None:
        flags = self.types.TracePacket.SEQ_NEEDS_INCREMENTAL_STATE
        self.write(timestamp=time_ns, sequence_flags=flags, **fields)

    def event(self, time_ns: int, track: int, kind: str, **what: Any) -> None:
        event = {"type": f"TYPE_{kind}", "track_uuid": track, **what}
        self.write_at(time_ns, track_event=event)

    def describe(self) -> None:
        # Timestamps count by the first clock; the second one lets the UI show points in time.
        numbers = map(
            self.types.BuiltinClock.Value, ("BUILTIN_CLOCK_BOOTTIME", "BUILTIN_CLOCK_REALTIME")
        )
        start_ns = self.run.start_ns or 0
        clocks = [{"clock_id": number, "timestamp": start_ns} for number in numbers]
        self.write(clock_snapshot={"clocks": clocks})
        for row in self.rows("perfetto_track"):
            self.write(**row)
        flags = self.types.TracePacket.SEQ_INCREMENTAL_STATE_CLEARED
        for row in self.rows("perfetto_interned_name"):
            self.write(sequence_flags=flags, **row)

    def slices(self) -> tuple[int, int]:
        """Return how many slices were written, and how many arrows begin at them."""
        slices = arrows = 0
        for row in self.rows("perfetto_slice_event"):
            event = row["track_event"]
            self.write_at(row["at_ns"], track_event=event)
            slices += event["type"] != "TYPE_SLICE_END"
            arrows += len(event["flow_ids"] or ())
        return slices, arrows

    def values(self) -> int:
        count = 0
        for row in self.rows("perfetto_value"):
            self.event(row["at_ns"], row["track"], "COUNTER", double_counter_value=row["value"])
            count += 1
        return count

    def named_slices(self, query: str, category: str, noted: Mapping[str, str]) -> int:
        count = 0
        known = None
        for row in self.rows(query):
            if row["track"] != known:
                known = row["track"]
                track = {"parent_uuid": row.get("parent"), "name": row["track_name"]}
                self.write(track_descriptor={"uuid": known, **track})
            said = {name: row[column] for name, column in noted.items()}
            self.event(
                row["start_ns"], row["track"], "SLICE_BEGIN",
                name=row["name"], categories=[category],
                debug_annotations=[_note(*each) for each in said.items() if each[1] is not None],
            )  # fmt: skip
            self.event(row["end_ns"], row["track"], "SLICE_END")
            count += 1
        return count

    def user_events(self) -> int:
        count = 0
        for row in self.rows("perfetto_event"):
            fields = [("user_event_id", row["id"]), *json.loads(row["fields"]).items()]
            self.event(
                row["at_ns"], row["track"], "INSTANT", name=row["name"], categories=["user_event"],
                debug_annotations=[_note(name, value) for name, value in fields],
            )  # fmt: skip
            count += 1
        return count

    def samples(self) -> int:
        """Write samples of stacks, each stack and function once; return how many samples."""
        timebase = {"counter": self.types.PerfEvents.Counter.SW_CPU_CLOCK}
        defaults = {"perf_sample_defaults": {"timebase": timebase}}
        for row in self.rows("perfetto_interned_stack"):
            self.write(trace_packet_defaults=defaults, **row)
        count = 0
        for row in self.rows("perfetto_sample"):
            sample = {name: row[name] for name in ("cpu", "pid", "tid")}
            self.write_at(row["at_ns"], perf_sample={**sample, "callstack_iid": row["stack_id"]})
            count += 1
        return count


def _note(name: str, value: Any) -> dict[str, Any]:
    match value:
        case bool():
            kind = "bool_value"
        case int():
            kind = "uint_value" if value > _LARGEST_INTEGER else "int_value"
        case float():
            kind = "double_value"
        case str():
            kind = "string_value"
        case _:
            kind, value = "legacy_json_value", json.dumps(value)
    return {"name": name, kind: value}
