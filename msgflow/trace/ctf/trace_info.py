"""Description of a trace: host, tracer, clock, begin and end."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow.errors import TraceError
from msgflow.trace.ctf.packet_times import end_of
from msgflow.trace.model import TraceInfo

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from msgflow.trace.ctf.declarations import EventClass, StreamClass, TraceClass
    from msgflow.trace.ctf.field_types import Structure
    from msgflow.trace.ctf.streams import Stream
    from msgflow.trace.time_base import TimeBase

_PROCESS_CONTEXT = {"vpid", "vtid"}


def describe(
    trace: TraceClass, path: Path, index: int, streams: Sequence[Stream], base: TimeBase
) -> TraceInfo:
    """Return the description of a trace that has event data, and put its clocks on `base`.

    Raises:
        TraceError: it declares no stream, or only some of its streams have times.
    """
    classes = list(trace.streams.values())
    used = [stream.layout.stream for stream in streams] or classes
    if not classes or any(stream.clock is None for stream in used):
        raise TraceError(
            f"some of the streams have no time stamps — {path}",
            hint="record with LTTng or ros2_tracing",
        )
    clock = used[0].clock
    assert clock is not None
    correction = base.correction_ns(clock.uuid, clock.name, clock.frequency, clock.to_ns(0))
    for stream_class in classes:
        if correction and stream_class.clock == clock:
            stream_class.clock = replace(clock, offset_cycles=clock.offset_cycles + correction)
    spans = [_range(stream) for stream in streams]
    begins = [begin for begin, _ in spans if begin is not None]
    ends = [end for _, end in spans if end is not None]
    environment = trace.environment
    return TraceInfo(
        index=index,
        path=path,
        uuid=trace.uuid,
        domain=_text(environment, "domain"),
        hostname=_text(environment, "hostname"),
        tracer=_tracer(environment),
        clock_uuid=clock.uuid,
        clock_name=clock.name,
        clock_offset_ns=clock.to_ns(0),
        clock_correction_ns=correction,
        begin_ns=min(begins, default=None),
        end_ns=max(ends, default=None),
        has_process_context=all(_has_process_context(stream) for stream in classes),
        event_names=tuple(
            sorted({event.name for stream in classes for event in stream.events.values()})
        ),
        has_time=used[0].has_time,
    )


def _range(stream: Stream) -> tuple[int | None, int | None]:
    clock = stream.layout.stream.clock
    assert clock is not None
    begins = [p.header.begin for p in stream.packets if p.header.begin is not None]
    ends = [p.header.end for p in stream.packets if p.header.end is not None]
    if ends:
        ends.append(end_of(stream, stream.packets[-1]) or 0)
    return (
        clock.to_ns(min(begins)) if begins else None,
        clock.to_ns(max(ends)) if ends else None,
    )


def _has_process_context(stream: StreamClass) -> bool:
    def has_both(event: EventClass) -> bool:
        return names(stream.event_context) | names(event.specific_context) >= _PROCESS_CONTEXT

    def names(structure: Structure) -> set[str]:
        return {member.name for member in structure.members}

    return all(has_both(event) for event in stream.events.values())


def _text(environment: Mapping[str, int | str], name: str) -> str | None:
    return str(environment[name]) if name in environment else None


def _tracer(environment: Mapping[str, int | str]) -> str | None:
    name = _text(environment, "tracer_name")
    if name is None:
        return None
    parts = ("tracer_major", "tracer_minor", "tracer_patchlevel", "tracer_patch")
    version = ".".join(str(environment[part]) for part in parts if part in environment)
    return f"{name} {version}".rstrip()
