"""Perfetto trace of a run, for the Perfetto UI.

Perfetto sorts packets by time and keeps the order of those at one moment. So each slice is written
whole, begin and end, the outer one before the inner ones.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.sql.failure import format_errors
from msgflow.sql.statement import internal_sql
from msgflow.text.installation import install_command

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice

_SEQUENCE = 1
_LARGEST_INTEGER = 2**63 - 1
_LARGEST_PID = 2**22


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
            install_command("perfetto"),
        ) from None
    with format_errors(run.name), replacing(path) as temporary, temporary.open("wb") as file:
        builder = StreamingTraceProtoBuilder(file)
        writer = _Writer(builder, perfetto_trace_pb2, connection, bindings)
        writer.describe(run.start_ns or 0)
        slices, arrows = writer.slices("perfetto_slice")
        values = writer.values()
        gaps, _ = writer.slices("perfetto_gap")
        events, _ = writer.slices("perfetto_event")
        states, _ = writer.slices("perfetto_state")
        samples = writer.samples()
    return PerfettoTrace(path, run, slices, arrows, values, gaps, events, states, samples)


@dataclass(frozen=True)
class _Writer:
    """Writes packets; a message inside of one is a dictionary, in which None stands for nothing."""

    builder: Any
    types: Any  # the module with the types of packets
    connection: duckdb.DuckDBPyConnection
    bindings: dict[str, Any]
    tracks: dict[Any, int] = field(default_factory=dict)
    threads: dict[int, dict[str, int]] = field(default_factory=dict)
    # Whose a pid or tid is.
    owners: dict[str, dict[int, int]] = field(default_factory=lambda: defaultdict(dict))
    # What packets refer to by number, in each list of `InternedData`; what the next one adds there.
    numbers: dict[str, dict[Any, int]] = field(default_factory=lambda: defaultdict(dict))
    added: dict[str, list[dict[str, Any]]] = field(default_factory=lambda: defaultdict(list))

    def rows(self, name: str) -> Iterator[dict[str, Any]]:
        return internal_sql().rows(self.connection, name, self.bindings)

    def write(self, **fields: Any) -> None:
        packet = self.types.TracePacket(
            trusted_packet_sequence_id=_SEQUENCE, interned_data=self.added or None, **fields
        )
        self.added.clear()
        self.builder.write_packet(packet)

    def write_at(self, time_ns: int, **fields: Any) -> None:
        flags = self.types.TracePacket.SEQ_NEEDS_INCREMENTAL_STATE
        self.write(timestamp=time_ns, sequence_flags=flags, **fields)

    def event(self, time_ns: int, track: int, kind: str, **what: Any) -> None:
        event = {"type": f"TYPE_{kind}", "track_uuid": track, **what}
        self.write_at(time_ns, track_event=event)

    def number(self, kind: str, **entry: Any) -> int:
        numbers, key = self.numbers[kind], tuple(entry.values())
        if key not in numbers:
            numbers[key] = len(numbers) + 1
            self.added[kind].append({"iid": numbers[key], **entry})
        return numbers[key]

    def track(self, *key: Any, **description: Any) -> int:
        """Return the number of a track, which is described when it is asked for first."""
        if key not in self.tracks:
            self.tracks[key] = len(self.tracks) + 1
            self.write(track_descriptor={"uuid": self.tracks[key], **description})
        return self.tracks[key]

    def own(self, kind: str, number: int, key: int) -> int:
        """Return a number that no other has: two hosts, or two lives, may have the same.

        Perfetto would take them for one.
        """
        first = self.owners[kind].setdefault(number, key)
        return number if first == key else _LARGEST_PID + key

    def describe(self, start_ns: int) -> None:
        # Timestamps count by the first clock; the second one lets the UI show points in time.
        numbers = map(
            self.types.BuiltinClock.Value, ("BUILTIN_CLOCK_BOOTTIME", "BUILTIN_CLOCK_REALTIME")
        )
        clocks = [{"clock_id": number, "timestamp": start_ns} for number in numbers]
        flags = self.types.TracePacket.SEQ_INCREMENTAL_STATE_CLEARED
        self.write(clock_snapshot={"clocks": clocks}, sequence_flags=flags)
        for row in self.rows("perfetto_process"):
            pid = self.own("pid", row["pid"], row["process_id"])
            described = {"pid": pid, "process_name": row["name"]}
            self.track("process", row["process_id"], process=described)
        for row in self.rows("perfetto_thread"):
            thread_id, process_id = row["thread_id"], row["process_id"]
            tid = self.own("tid", row["tid"], thread_id)
            self.threads[thread_id] = {"pid": self.own("pid", row["pid"], process_id), "tid": tid}
            described = {**self.threads[thread_id], "thread_name": row["name"]}
            process = self.track("process", process_id)
            self.track("thread", thread_id, parent_uuid=process, thread=described)

    def slices(self, query: str) -> tuple[int, int]:
        """Return how many slices a query has, and how many arrows begin at them.

        They lie on the track of their thread, or on one that has a name. Columns that say no more
        about this are arguments.
        """
        slices = arrows = 0
        for row in self.rows(query):
            start_ns, end_ns = row.pop("start_ns"), row.pop("end_ns")
            outgoing = row.pop("outgoing", None)
            thread, track = row.pop("thread_id", None), row.pop("track", None)
            place: Any = self.tracks.get(("thread", thread))
            if track is not None:
                place = self.track(
                    track, thread, row.pop("host_id", None), parent_uuid=place, name=track
                )
            what = {
                "category_iids": [self.number("event_categories", name=row.pop("category"))],
                "name_iid": self.number("event_names", name=row.pop("name")),
                "flow_ids": outgoing,
                "terminating_flow_ids": row.pop("incoming", None),
            }
            if "kind" in row:
                row[f"{row.pop('kind')}_id"] = row.pop("id")
            fields = row.pop("fields", None)
            said = {name: value for name, value in row.items() if value is not None}
            if fields is not None:
                said |= json.loads(fields)
            what["debug_annotations"] = [self.note(*each) for each in said.items()]
            if end_ns > start_ns:
                self.event(start_ns, place, "SLICE_BEGIN", **what)
                self.event(end_ns, place, "SLICE_END")
            else:
                self.event(start_ns, place, "INSTANT", **what)
            slices += 1
            arrows += len(outgoing or ())
        return slices, arrows

    def note(self, name: str, value: Any) -> dict[str, Any]:
        match value:
            case bool():
                kind = "bool_value"
            case int():
                kind = "uint_value" if value > _LARGEST_INTEGER else "int_value"
            case float():
                kind = "double_value"
            case str() if name == "symbol":  # long, and each callback instance has one
                kind = "string_value_iid"
                value = self.number("debug_annotation_string_values", str=value.encode())
            case str():
                kind = "string_value"
            case _:
                kind, value = "legacy_json_value", json.dumps(value)
        return {"name_iid": self.number("debug_annotation_names", name=name), kind: value}

    def values(self) -> int:
        count = 0
        for row in self.rows("perfetto_value"):
            # A program without ROS has none.
            process = self.tracks.get(("process", row["process_id"]))
            name, unit = row["name"], {"unit_name": row["unit"]}
            track = self.track(
                row["kind"], row["id"], name, parent_uuid=process, name=name, counter=unit
            )
            self.event(row["at_ns"], track, "COUNTER", double_counter_value=row["value"])
            count += 1
        return count

    def samples(self) -> int:
        """Write samples of stacks, each stack and function once; return how many samples."""
        timebase = {"counter": self.types.PerfEvents.Counter.SW_CPU_CLOCK}
        self.write(trace_packet_defaults={"perf_sample_defaults": {"timebase": timebase}})
        for row in self.rows("perfetto_stack"):
            frames = [self.frame(**each) for each in row["frames"]]
            self.added["callstacks"].append({"iid": row["stack_id"], "frame_ids": frames})
        count = 0
        for row in self.rows("perfetto_sample"):
            thread = self.threads[row["thread_id"]]
            sample = {"cpu": row["cpu"], "callstack_iid": row["stack_id"], **thread}
            self.write_at(row["at_ns"], perf_sample=sample)
            count += 1
        return count

    def frame(self, function: str, file: str) -> int:
        path = self.number("mapping_paths", str=file.encode())
        return self.number(
            "frames",
            function_name_id=self.number("function_names", str=function.encode()),
            mapping_id=self.number("mappings", path_string_ids=(path,)),
        )
