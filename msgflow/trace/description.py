"""Descriptions of traces: what the metadata declares, put into one form for every reader."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.trace.model import TraceInfo

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence, Set
    from pathlib import Path

    from msgflow.trace.ctf.clock import Clock


_PROCESS_CONTEXT = {"vpid", "vtid"}


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
    return TraceInfo(
        index=index,
        path=path,
        uuid=uuid,
        domain=_text(environment, "domain"),
        hostname=_text(environment, "hostname"),
        tracer=_tracer(environment),
        clock_uuid=clock.uuid,
        clock_name=clock.name,
        clock_offset_ns=clock.to_ns(0),
        clock_frequency=clock.frequency,
        clock_correction_ns=0,
        begin_ns=min(begins, default=None),
        end_ns=max(ends, default=None),
        has_process_context=all(contexts >= _PROCESS_CONTEXT for _, contexts in events),
        event_names=tuple(sorted({name for name, _ in events})),
        has_time=has_time,
    )


def _text(environment: Mapping[str, int | str], name: str) -> str | None:
    return str(environment[name]) if name in environment else None


def _tracer(environment: Mapping[str, int | str]) -> str | None:
    name = _text(environment, "tracer_name")
    if name is None:
        return None
    parts = ("tracer_major", "tracer_minor", "tracer_patchlevel", "tracer_patch")
    version = ".".join(str(environment[part]) for part in parts if part in environment)
    return f"{name} {version}".rstrip()
