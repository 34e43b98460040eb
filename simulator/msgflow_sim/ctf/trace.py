"""Traces: directory, metadata, one stream per CPU."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import UUID

from msgflow_sim.ctf.metadata import metadata_text, packets
from msgflow_sim.ctf.stream import Break, Ending, Faults, StreamWriter

if TYPE_CHECKING:
    from msgflow_sim.layout import Layout

USER_ID = 1000
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
        buffering: 'uid' or 'pid', with what belongs to it: the id and, for 'pid', the name;
            'global' is a trace of the kernel.
    """

    session: str
    hostname: str
    uuid: UUID
    boot_uuid: UUID
    epoch_ns: int
    uptime_ns: int
    buffering: tuple[str, int, str] = ("uid", USER_ID, "")


class TraceWriter:
    """Writes one trace of LTTng, a stream for each CPU.

    Attributes:
        directory: where `metadata` lies, in the first chunk of a rotated trace.
        directories: of all chunks.
        streams: one per CPU.
    """

    def __init__(
        self,
        directory: Path,
        layout: Layout,
        identity: TraceIdentity,
        cpu_count: int,
        *,
        begin: int = 0,
        breaks: Sequence[Break] = (),
        faults: Faults | None = None,
        ending: Callable[[int], Ending | None] = lambda cpu: None,
        packet_bytes: int = 0,
        kept_packets: int = 0,
    ) -> None:
        """Make the directories and open the files; `ending` is asked for each CPU.

        Packets have `packet_bytes`, as many as usual in the layout if 0; for `kept_packets` see
        `StreamWriter`.
        """
        self.directory = directory
        chunks = (chunk.directory for chunk in breaks)
        self.directories = tuple(
            dict.fromkeys((directory, *(chunk for chunk in chunks if chunk is not None)))
        )
        self._missing = [chunk.directory for chunk in breaks if chunk.is_missing]
        text = metadata_text(
            layout,
            uuid=identity.uuid,
            clock_uuid=identity.boot_uuid,
            clock_offset=identity.epoch_ns - identity.uptime_ns,
            environment=_environment(identity, layout.tracer_minor),
        )
        for chunk in self.directories:
            (chunk / "index").mkdir(parents=True)
            with (chunk / "metadata").open("wb") as file:
                file.writelines(packets(text, identity.uuid))
        self.streams = tuple(
            StreamWriter(
                directory,
                "kernel" if identity.buffering[0] == "global" else "ros2",
                identity.uuid,
                cpu,
                identity.uptime_ns,
                packet_bytes or layout.packet_bytes,
                begin=begin,
                breaks=breaks,
                faults=faults,
                ending=ending(cpu),
                kept_packets=kept_packets,
            )
            for cpu in range(cpu_count)
        )

    def close(self, end: int) -> None:
        """Complete the files; tracing stops at time `end`."""
        for stream in self.streams:
            stream.close(end)
        for directory in self._missing:
            if directory is not None:
                shutil.rmtree(directory)
        self.directories = tuple(one for one in self.directories if one not in self._missing)


def _environment(identity: TraceIdentity, tracer_minor: int) -> dict[str, str | int]:
    created = datetime.fromtimestamp(identity.epoch_ns // _NANOSECONDS, timezone.utc)
    scheme, buffering_id, process_name = identity.buffering
    common: dict[str, str | int] = {
        "trace_name": f"{identity.session}-{created:%Y%m%d%H%M%S}",
        "trace_creation_datetime": f"{created:%Y%m%dT%H%M%S}+0000",
        "hostname": identity.hostname,
    }
    if scheme == "global":
        return {
            "domain": "kernel",
            "sysname": "Linux",
            "kernel_release": "6.8.0-45-generic",
            "tracer_name": "lttng-modules",
            "tracer_major": 2,
            "tracer_minor": tracer_minor,
            "trace_buffering_scheme": scheme,
            **common,
        }
    named: dict[str, str | int] = {}
    if scheme == "pid":
        named = {"procname": process_name, "vpid": buffering_id}
    return {
        "domain": "ust",
        "tracer_name": "lttng-ust",
        "tracer_major": 2,
        "tracer_minor": tracer_minor,
        "tracer_buffering_scheme": scheme,
        "tracer_buffering_id": buffering_id,
        "architecture_bit_width": 64,
        **named,
        **common,
    }
