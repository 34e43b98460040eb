"""A whole trace of one host: directory, metadata, one stream per CPU."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from msgflow.sim.ctf.metadata import metadata_text, packets
from msgflow.sim.ctf.stream import StreamWriter
from msgflow.sim.ctf.tracepoint import Tracepoint

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path
    from uuid import UUID

    from msgflow.sim.layout import Layout

_USER_ID = 1000
_NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class TraceIdentity:
    """What tells a trace from others.

    Attributes:
        session: name of the recording session.
        hostname: host it was recorded on.
        uuid: of the trace.
        boot_uuid: of the host's boot, hence of its clock.
        epoch_ns: time 0 of the trace in ns since the epoch, on the host's own clock.
        uptime_ns: how long before time 0 the host booted, which is what its clock shows then.
    """

    session: str
    hostname: str
    uuid: UUID
    boot_uuid: UUID
    epoch_ns: int
    uptime_ns: int


class TraceWriter:
    """Writes one LTTng-UST trace, with buffers per user and CPU.

    Attributes:
        directory: where `metadata` lies.
        streams: one per CPU.
    """

    def __init__(
        self, directory: Path, layout: Layout, identity: TraceIdentity, cpu_count: int
    ) -> None:
        self.directory = directory / "ust" / "uid" / str(_USER_ID) / "64-bit"
        index = self.directory / "index"
        index.mkdir(parents=True)
        text = metadata_text(
            layout,
            uuid=identity.uuid,
            clock_uuid=identity.boot_uuid,
            clock_offset=identity.epoch_ns - identity.uptime_ns,
            environment=_environment(identity),
        )
        with (self.directory / "metadata").open("wb") as file:
            file.writelines(packets(text, identity.uuid))
        self._tracepoints = {
            event.name: Tracepoint(event, event_id) for event_id, event in enumerate(layout.events)
        }
        self.streams = tuple(
            StreamWriter(
                self.directory / f"ros2_{cpu}",
                index / f"ros2_{cpu}.idx",
                identity.uuid,
                cpu,
                identity.uptime_ns,
                begin=0,
            )
            for cpu in range(cpu_count)
        )

    def tracepoint(self, name: str) -> Tracepoint:
        """The event class of this full name; KeyError if the layout does not have it."""
        return self._tracepoints[name]

    def event_counts(self) -> Mapping[str, int]:
        """Events written so far by name, those that occurred."""
        return {name: point.count for name, point in self._tracepoints.items() if point.count}

    def close(self, end: int) -> None:
        """Complete the files; tracing stops at time `end`."""
        for stream in self.streams:
            stream.close(end)


def _environment(identity: TraceIdentity) -> dict[str, str | int]:
    created = datetime.fromtimestamp(identity.epoch_ns // _NANOSECONDS, UTC)
    return {
        "domain": "ust",
        "tracer_name": "lttng-ust",
        "tracer_major": 2,
        "tracer_minor": 13,
        "tracer_buffering_scheme": "uid",
        "tracer_buffering_id": _USER_ID,
        "architecture_bit_width": 64,
        "trace_name": f"{identity.session}-{created:%Y%m%d%H%M%S}",
        "trace_creation_datetime": f"{created:%Y%m%dT%H%M%S}+0000",
        "hostname": identity.hostname,
    }
