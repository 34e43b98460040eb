"""Description of a trace, as Babeltrace 2 reads it from the metadata and the packets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.errors import TraceError
from msgflow.trace.bt2_fields import schema_of
from msgflow.trace.bt2_messages import messages, parameters_of
from msgflow.trace.ctf.clock import Clock
from msgflow.trace.ctf.trace_info import description
from msgflow.trace.metadata_frame import MetadataKind, kind_of
from msgflow.trace.model import TraceInfo

if TYPE_CHECKING:
    from pathlib import Path


def describe(bt2: Any, path: Path, index: int) -> tuple[TraceInfo, list[Any]]:
    """Describe one trace, with names and payload schemas of its events."""
    if kind_of(path) is MetadataKind.JSON and bt2.__version__ < "2.1":
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
        environment={str(name): str(value) for name, value in trace.environment.items()},
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
