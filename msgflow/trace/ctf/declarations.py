"""What the metadata of one trace declares."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from msgflow.trace.ctf.types import Structure

if TYPE_CHECKING:
    from msgflow.trace.ctf.clock import Clock


class MetadataError(Exception):
    """The metadata cannot be understood; the message says why and where."""


@dataclass(eq=False)
class EventClass:
    """One kind of event."""

    id: int
    name: str
    specific_context: Structure = field(default_factory=Structure)
    payload: Structure = field(default_factory=Structure)


@dataclass(eq=False)
class StreamClass:
    """One kind of stream (LTTng: channel) and its events."""

    id: int
    packet_context: Structure = field(default_factory=Structure)
    event_header: Structure = field(default_factory=Structure)
    event_context: Structure = field(default_factory=Structure)
    clock: Clock | None = None
    events: dict[int, EventClass] = field(default_factory=dict)


@dataclass(eq=False)
class TraceClass:
    """All of a trace's metadata."""

    uuid: str | None = None
    environment: dict[str, int | str] = field(default_factory=dict)
    packet_header: Structure = field(default_factory=Structure)
    streams: dict[int, StreamClass] = field(default_factory=dict)
