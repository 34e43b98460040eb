"""What a trace declares about itself, through Babeltrace."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgflow.errors import TraceError
from msgflow.trace.bt2_graph import damaged_error, plugin_class, source_parameters
from msgflow.trace.bt2_streams import Clock
from msgflow.trace.discovery import stream_files
from msgflow.trace.metadata import MetadataKind, kind_of
from msgflow.trace.model import TraceInfo, undeclared

if TYPE_CHECKING:
    from pathlib import Path

    from msgflow.trace.bt2_library import Bt2Library
    from msgflow.trace.model import TraceLocation
    from msgflow.trace.time_base import TimeBase

_STREAM_MAGIC = (b"\xc1\x1f\xfc\xc1", b"\xc1\xfc\x1f\xc1")
_PROCESS_CONTEXT = {"vpid", "vtid"}


def describe(library: Bt2Library, location: TraceLocation, index: int, base: TimeBase) -> TraceInfo:
    """Read the metadata and the packet index of one trace, and put its clock on `base`.

    Raises:
        TraceError: Babeltrace cannot open it.
    """
    if kind_of(location.path) is MetadataKind.JSON and not library.reads_ctf2:
        raise TraceError(
            "the trace is CTF 2, which needs babeltrace2 2.1 or newer, here is "
            f"{'.'.join(map(str, library.version))} — {location.path}",
            hint="record with `lttng create --trace-format=ctf-1.8`, or install a newer "
            "python3-bt2",
        )
    bt2 = library.bt2
    try:
        trace = _first_trace(library, location)
        if trace is None:
            return undeclared(location.path, index)
        # Only after the trace could be opened: on a damaged one this query ends the process.
        begin_ns, end_ns = _range(library, location)
        return _info(trace, location, index, (begin_ns, end_ns), base)
    except bt2._Error as error:
        stranger = _not_a_stream(location)
        if stranger is not None:
            raise TraceError(
                f"a file that is not part of the trace lies in its directory — {stranger}",
                hint=f"mv {stranger} {location.path.parent}",
            ) from error
        raise damaged_error(location.path, error) from error


def _not_a_stream(location: TraceLocation) -> Path | None:
    """Return a file among the streams that does not begin as a stream does."""
    for path in stream_files(location.path):
        with path.open("rb") as file:
            begin = file.read(len(_STREAM_MAGIC[0]))
        if begin and begin not in _STREAM_MAGIC:
            return path
    return None


def _range(library: Bt2Library, location: TraceLocation) -> tuple[int | None, int | None]:
    """Return the first begin and the last end of all streams, from the packet index."""
    source_class = plugin_class(library, "ctf", "source", "fs")
    query = library.bt2.QueryExecutor(
        source_class, "babeltrace.trace-infos", source_parameters(location.path)
    )
    ranges = [
        stream["range-ns"]
        for trace in query.query()
        for stream in trace["stream-infos"]
        if "range-ns" in stream
    ]
    begin = min((int(span["begin"]) for span in ranges), default=None)
    end = max((int(span["end"]) for span in ranges), default=None)
    return begin, end


def _first_trace(library: Bt2Library, location: TraceLocation) -> Any:
    bt2 = library.bt2
    specification = bt2.ComponentSpec(
        plugin_class(library, "ctf", "source", "fs"), source_parameters(location.path)
    )
    for message in bt2.TraceCollectionMessageIterator(specification):
        return message.stream.trace
    return None


def _info(
    trace: Any,
    location: TraceLocation,
    index: int,
    extent: tuple[int | None, int | None],
    base: TimeBase,
) -> TraceInfo:
    environment = {str(name): value for name, value in trace.environment.items()}
    stream_classes = list(trace.cls.values())
    clocks = [sc.default_clock_class for sc in stream_classes if sc.default_clock_class]
    if not clocks:
        raise TraceError(
            f"the events have no time stamps — {location.path}",
            hint="record with LTTng or ros2_tracing",
        )
    clock = clocks[0]
    offset = clock.offset
    epoch = Clock(clock.frequency, offset.seconds, offset.cycles)
    uuid = None if clock.uuid is None else str(clock.uuid)
    correction = base.correction_ns(uuid, clock.name, clock.frequency, epoch.to_ns(0))
    begin_ns, end_ns = (None if time is None else time + correction for time in extent)
    return TraceInfo(
        index=index,
        path=location.path,
        uuid=None if trace.uuid is None else str(trace.uuid),
        domain=_text(environment, "domain"),
        hostname=_text(environment, "hostname"),
        tracer=_tracer(environment),
        clock_uuid=uuid,
        clock_name=clock.name,
        clock_offset_ns=epoch.to_ns(0),
        clock_correction_ns=correction,
        begin_ns=begin_ns,
        end_ns=end_ns,
        has_process_context=all(_has_process_context(sc) for sc in stream_classes),
        event_names=tuple(
            sorted({event.name or "" for sc in stream_classes for event in sc.values()})
        ),
    )


def _has_process_context(stream_class: Any) -> bool:
    common = _member_names(stream_class.event_common_context_field_class)
    return all(
        common | _member_names(event.specific_context_field_class) >= _PROCESS_CONTEXT
        for event in stream_class.values()
    )


def _member_names(structure: Any) -> set[str]:
    return set() if structure is None else {str(name) for name in structure}


def _text(environment: dict[str, Any], name: str) -> str | None:
    return str(environment[name]) if name in environment else None


def _tracer(environment: dict[str, Any]) -> str | None:
    name = _text(environment, "tracer_name")
    if name is None:
        return None
    parts = ("tracer_major", "tracer_minor", "tracer_patchlevel", "tracer_patch")
    version = ".".join(str(environment[part]) for part in parts if part in environment)
    return f"{name} {version}".rstrip()
