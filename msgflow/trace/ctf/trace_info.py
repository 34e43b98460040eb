"""Description of a trace: host, tracer, clock, begin and end, in one form for every reader."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from pathlib import Path

from msgflow.errors import TraceError
from msgflow.trace.ctf.declarations import Clock, TraceClass
from msgflow.trace.ctf.field_types import Structure
from msgflow.trace.ctf.packet_times import end_of
from msgflow.trace.ctf.packets import Stream
from msgflow.trace.model import TraceInfo

_PROCESS_CONTEXT = {"vpid", "vtid"}


def describe(trace: TraceClass, path: Path, index: int, streams: Sequence[Stream]) -> TraceInfo:
    """Return the description of a trace that has event data."""
    classes = list(trace.streams.values())
    used = [stream.layout.stream for stream in streams] or classes
    if not classes or any(stream.clock is None for stream in used):
        raise TraceError(
            f"some of the streams have no time stamps — {path}",
            hint="record with LTTng or ros2_tracing",
        )
    clock = used[0].clock
    assert clock is not None
    spans = [_range(stream) for stream in streams]
    return description(
        path,
        index,
        uuid=trace.uuid,
        environment=trace.environment,
        clock=clock,
        begins=[begin for begin, _ in spans if begin is not None],
        ends=[end for _, end in spans if end is not None],
        events=[
            (event.name, _names(stream.event_context) | _names(event.specific_context))
            for stream in classes
            for event in stream.events.values()
        ],
        has_time=used[0].has_time,
    )


def _range(stream: Stream) -> tuple[int | None, int | None]:
    clock = stream.layout.clock
    begins = [p.header.begin for p in stream.packets if p.header.begin is not None]
    ends = [p.header.end for p in stream.packets if p.header.end is not None]
    if ends:
        ends.append(end_of(stream, stream.packets[-1]) or 0)
    return (
        clock.to_ns(min(begins)) if begins else None,
        clock.to_ns(max(ends)) if ends else None,
    )


def _names(structure: Structure) -> set[str]:
    return {member.name for member in structure.members}


def corrected(clock: Clock | None, info: TraceInfo) -> Clock | None:
    """Return the clock of a stream, on the time base that its trace was brought to."""
    correction = info.clock_correction_ns
    if clock is None or not correction or clock.to_ns(0) != info.clock_offset_ns:
        return clock
    return replace(clock, offset_cycles=clock.offset_cycles + correction)


def description(
    path: Path,
    index: int,
    *,
    uuid: str | None,
    environment: Mapping[str, int | str],
    clock: Clock,
    begins: Sequence[int],
    ends: Sequence[int],
    events: Sequence[tuple[str, Set[str]]],
    has_time: bool = True,
) -> TraceInfo:
    """Describe a trace, with its times as declared.

    `begins` and `ends` are those of its streams, in ns since the epoch by the declared clock. An
    event has a name and the names of its contexts.
    """
    said = {name: str(value) for name, value in environment.items()}
    return TraceInfo(
        index=index,
        path=path,
        uuid=uuid,
        domain=said.get("domain"),
        hostname=said.get("hostname"),
        tracer=_tracer(said),
        clock_uuid=clock.uuid,
        clock_name=clock.name,
        clock_offset_ns=clock.to_ns(0),
        clock_frequency=clock.frequency,
        begin_ns=min(begins, default=None),
        end_ns=max(ends, default=None),
        has_process_context=all(contexts >= _PROCESS_CONTEXT for _, contexts in events),
        counters=tuple(sorted({name for _, of in events for name in of if _is_counter(name)})),
        event_names=tuple(sorted({name for name, _ in events})),
        has_time=has_time,
    )


def _is_counter(context: str) -> bool:
    """Tell whether a context is what `lttng add-context --type=perf:thread:…` adds."""
    return context.startswith("perf_thread_")


def _tracer(environment: Mapping[str, str]) -> str | None:
    if "tracer_name" not in environment:
        return None
    parts = ("tracer_major", "tracer_minor", "tracer_patchlevel", "tracer_patch")
    version = ".".join(environment[part] for part in parts if part in environment)
    return f"{environment['tracer_name']} {version}".rstrip()
