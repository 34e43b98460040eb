"""Recorder of a host: which traces it has, and what is missing from them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import datetime, timezone
from hashlib import sha256
from itertools import chain
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING
from uuid import UUID

from msgflow_sim.ctf import (
    USER_ID,
    Break,
    Ending,
    TraceIdentity,
    Tracepoint,
    TraceWriter,
    thread_of,
)
from msgflow_sim.events import OWN_SIGNATURES, SIGNATURES
from msgflow_sim.kernel_trace import write_kernel
from msgflow_sim.recording import Buffers, Recording

if TYPE_CHECKING:
    from msgflow_sim.host_clock import HostClock
    from msgflow_sim.kernel import Kernel
    from msgflow_sim.layout import Layout
    from msgflow_sim.truth import Truth

# What the session that only waits for its snapshot has enabled.
_INITIALISATION = (
    "_init",
    "_callback_added",
    "rclcpp_callback_register",
    "rclcpp_timer_link_node",
    "rclcpp_construct_ring_buffer",
    "rclcpp_buffer_to_ipb",
    "rclcpp_ipb_to_subscription",
)

_FOR_EVER = 1 << 62


class Tracepoints:
    """The events as the simulation emits them, one attribute each.

    Those of `ros2` have their short names (`rcl_init`), others their provider's name before it
    (`dds_write`). An event that the layout does not have is there too: emitting it does nothing.
    """

    def __init__(self, layout: Layout) -> None:
        numbers = {event.name: number for number, event in enumerate(layout.events)}
        self._all: dict[str, Tracepoint] = {}
        for name, signature in {**SIGNATURES, **OWN_SIGNATURES}.items():
            number = numbers.get(name)
            fields = None if number is None else layout.events[number].fields
            tracepoint = Tracepoint(name, number or 0, signature, fields)
            self._all[name] = tracepoint
            setattr(self, name.removeprefix("ros2:").replace(":", "_"), tracepoint)

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Tracepoint: ...

    def counts(self) -> Mapping[str, int]:
        """Events recorded so far by name, those that occurred."""
        return {name: point.count for name, point in self._all.items() if point.count}


class Recorder:
    """Writes the traces of one host.

    Attributes:
        layout: of the traces.
        cpu_count: how many CPUs write streams.
        tracepoints: what can be emitted.
        emitters: `emit(tracepoint, time, context, *values)` for each CPU.
    """

    def __init__(
        self,
        directory: Path,
        layout: Layout,
        identity: TraceIdentity,
        cpu_count: int,
        recording: Recording,
        truth: Truth,
        clock: HostClock,
        stop: int,
    ) -> None:
        """Open the files; recording is asked to stop at time `stop`."""
        self.layout = layout
        self.cpu_count = cpu_count
        self.tracepoints = Tracepoints(layout)
        self._directory = directory
        self._identity = identity
        self._recording = recording
        self._truth = truth
        self._clock = clock
        self._end = stop
        self._stop = clock.elapsed(stop)
        self._losses = tuple(
            (clock.elapsed(begin), clock.elapsed(end)) for begin, end in recording.losses
        )
        self._random = Random(str(identity.uuid))
        self._snapshot: TraceWriter | None = None
        self._writers: dict[int, TraceWriter] = {}
        # Of which process each trace is, by its uuid; None: of all.
        self._pids: dict[bytes, int | None] = {}
        if recording.is_perfect:
            only = self._writer(0, "")
            self.emitters: tuple[Callable[..., None], ...] = tuple(
                self._on_clock(stream.emit) for stream in only.streams
            )
            return
        if recording.is_dual_session:
            self._snapshot = self._trace(
                "snapshot", ("uid", USER_ID, ""), breaks=(), begin=0, is_faultless=True
            )
        if recording.buffers is Buffers.PER_USER:
            self._writer(0, "")
        self.emitters = tuple(self._on_clock(self._emitter(cpu)) for cpu in range(cpu_count))

    @property
    def directories(self) -> tuple[Path, ...]:
        """Where `metadata` files lie."""
        snapshot = () if self._snapshot is None else self._snapshot.directories
        return (
            *snapshot,
            *(path for writer in self._writers.values() for path in writer.directories),
        )

    def close(self, end: int) -> None:
        """Complete the files; tracing stops at time `end`."""
        start, end = self._clock.elapsed(self._recording.start_ns), self._clock.elapsed(end)
        if self._snapshot is not None:
            self._snapshot.close(min(end, start))
        for writer in self._writers.values():
            writer.close(max(end, start + 1))

    def write_kernel(self, kernel: Kernel, end: int) -> None:
        """Write the trace of the kernel up to time `end`."""
        write_kernel(
            kernel,
            self._directory,
            self._identity,
            self._clock,
            self._truth,
            end,
            self._recording.kernel_tracer,
        )

    # What a stream asks when it is recorded with faults.

    def lost_events(self, cpu: int) -> int:
        """How many events are lost behind the packet of a CPU that is now full."""
        if self._recording.lossy_cpus and cpu not in self._recording.lossy_cpus:
            return 0
        if self._random.random() >= self._recording.lost_event_share:
            return 0
        return self._random.randint(1, self._recording.longest_loss)

    def is_filled(self) -> bool:
        """Whether the packet that is now full ends with its last event."""
        share = self._recording.filled_share
        return share > 0 and self._random.random() < share

    def is_packet_lost(self) -> bool:
        """Whether the packet that is now full is lost."""
        return self._random.random() < self._recording.lost_packet_share

    def is_losing(self, time: int) -> bool:
        """Whether what happens at `time` is lost."""
        return any(begin <= time < end for begin, end in self._losses)

    def emitted(self, cpu: int, time: int, context: bytes) -> None:
        """Write down when something came into the buffers of a CPU."""
        pid, tid, _ = thread_of(context)
        identity = self._identity
        self._truth.emitted.add(identity.hostname, pid, tid, cpu, time + identity.epoch_ns)

    def unrecorded(
        self, cpu: int, tracepoint: Tracepoint, time: int, context: bytes, cause: str
    ) -> None:
        """Write down an event that the trace should have and has not."""
        pid, tid, _ = thread_of(context)
        identity = self._identity
        self._truth.unrecorded.add(
            identity.hostname, pid, tid, cpu, tracepoint.name, time + identity.epoch_ns, cause
        )

    def missing_packet(self, trace: bytes, cpu: int, since: int, end: int, cause: str) -> None:
        """Write down a packet without events that the trace shows to be missing."""
        identity = self._identity
        self._truth.missing_packet.add(
            identity.hostname,
            self._pids[trace],
            cpu,
            since + identity.epoch_ns,
            end + identity.epoch_ns,
            cause,
        )

    def _on_clock(self, emit: Callable[..., None]) -> Callable[..., None]:
        """Return what emits events at the times that the clock of the host shows."""
        if not self._clock.drift_ppb:
            return emit
        elapsed = self._clock.elapsed

        def emit_on_clock(
            tracepoint: Tracepoint, time: int, context: bytes, *values: object
        ) -> None:
            emit(tracepoint, elapsed(time), context, *values)

        return emit_on_clock

    def _emitter(self, cpu: int) -> Callable[..., None]:
        start = self._clock.elapsed(self._recording.start_ns)
        is_per_process = self._recording.buffers is Buffers.PER_PROCESS
        absences: dict[int, tuple[tuple[int, int, str], ...]] = {}

        def absence(context: bytes, time: int) -> str | None:
            """Why the process is not recorded at `time`, though the session is."""
            pid, _, _ = thread_of(context)
            if pid not in absences:
                absences[pid] = tuple(self._absences(pid))
            for begin, end, cause in absences[pid]:
                if begin <= time < end:
                    return cause
            return None

        def emit(tracepoint: Tracepoint, time: int, context: bytes, *values: object) -> None:
            if tracepoint.pack is None:
                return
            if time < start:
                if self._snapshot is not None and tracepoint.name.endswith(_INITIALISATION):
                    self._snapshot.streams[cpu].emit(tracepoint, time, context, *values)
                else:
                    self.unrecorded(cpu, tracepoint, time, context, "late start")
                return
            if self._recording.handover_ns and (cause := absence(context, time)) is not None:
                self.unrecorded(cpu, tracepoint, time, context, cause)
                return
            pid, name = 0, ""
            if is_per_process:
                pid, _, name = thread_of(context)
            self._writer(pid, name).streams[cpu].emit(tracepoint, time, context, *values)

        return emit

    def _absences(self, pid: int) -> Iterator[tuple[int, int, str]]:
        """When a process that is there all the time has not joined yet, or has left already."""
        shown, recording = self._clock.elapsed, self._recording
        random = Random(f"{self._identity.uuid}/{pid}")
        if recording.start_ns:
            start = shown(recording.start_ns)
            yield start, start + int(random.random() * recording.handover_ns), "late start"
        for pause in recording.pauses:
            begin, end = (shown(time) for time in pause)
            yield begin - int(random.random() * recording.handover_ns), begin, "pause"
            yield end, end + int(random.random() * recording.handover_ns), "pause"
        yield self._stop - int(random.random() * recording.handover_ns), _FOR_EVER, "stop"

    def _writer(self, pid: int, name: str) -> TraceWriter:
        """The trace of a process, or that of the user if `pid` is 0."""
        writer = self._writers.get(pid)
        if writer is None:
            shown = self._clock.elapsed
            session = "runtime" if self._recording.is_dual_session else ""
            buffering = ("pid", pid, name) if pid else ("uid", USER_ID, "")
            writer = self._writers[pid] = self._trace(
                session,
                buffering,
                breaks=tuple(
                    Break(shown(begin), shown(end), is_rotation=is_rotation)
                    for begin, end, is_rotation in self._breaks()
                ),
                begin=shown(self._recording.start_ns),
            )
        return writer

    def _breaks(self) -> Iterator[tuple[int, int, bool]]:
        """Yield (begin, end, is rotation) of pauses, rotations, snapshots and flushes.

        Each ends all packets. After a rotation or snapshot the next packets are in a new directory.
        A session that is rotated while it is stopped uses that directory when it starts again.
        """
        recording = self._recording
        times = (*recording.rotations, *recording.snapshots)
        for begin, end in recording.pauses:
            yield begin, end, any(begin < time < end for time in times)
        for time in times:
            if not any(begin < time < end for begin, end in recording.pauses):
                yield time, time, True
        if recording.flush_ns:
            for time in range(recording.start_ns, self._end, recording.flush_ns):
                stopped = chain(recording.pauses, ((other, other) for other in times))
                if time > recording.start_ns and not any(
                    begin <= time <= end for begin, end in stopped
                ):
                    yield time, time, False

    def _trace(
        self,
        session: str,
        buffering: tuple[str, int, str],
        *,
        breaks: tuple[Break, ...],
        begin: int,
        is_faultless: bool = False,
    ) -> TraceWriter:
        identity, recording = self._identity, self._recording
        _, pid, _ = buffering
        error = 0
        if session != "runtime" and recording.clock_error_ns:
            error = self._random.randint(-recording.clock_error_ns, recording.clock_error_ns)
        uuid = identity.uuid
        if session or buffering[0] == "pid":
            digest = sha256(f"{identity.uuid}/{session}/{buffering}".encode()).digest()
            uuid = UUID(bytes=digest[:16], version=4)
        of_pid = pid if buffering[0] == "pid" else None
        self._pids[uuid.bytes] = of_pid
        base = self._directory / session
        paths = self._chunks(base, buffering)
        first = next(paths)
        if not is_faultless:
            self._truth.trace.add(
                identity.hostname,
                of_pid,
                str(first.relative_to(self._directory.parent)),
                error,
            )
        missing = None
        if recording.missing_chunk:
            missing = self._clock.elapsed(sorted(recording.rotations)[recording.missing_chunk - 1])
        ordered = sorted(breaks, key=lambda one: one.begin)
        is_snapshot = bool(recording.snapshots) and not is_faultless
        followed = [one for one in ordered if one.is_rotation]
        if is_snapshot:
            paths = chain((first,), paths)
        continued = tuple(
            replace(
                one,
                directory=next(paths),
                is_missing=one.begin == missing
                or (recording.is_last_snapshot_only and one is not followed[-1]),
            )
            if one.is_rotation
            else one
            for one in ordered
        )
        return TraceWriter(
            first,
            self.layout,
            replace(
                identity,
                uuid=uuid,
                epoch_ns=identity.epoch_ns + error,
                buffering=buffering,
            ),
            self.cpu_count,
            begin=begin,
            breaks=continued,
            faults=None if recording.is_perfect or is_faultless else self,
            ending=lambda cpu: None if is_faultless else self._ending(cpu),
            packet_bytes=0 if is_faultless else recording.packet_bytes,
            kept_packets=recording.kept_packets if is_snapshot else 0,
        )

    def _chunks(self, base: Path, buffering: tuple[str, int, str]) -> Iterator[Path]:
        """Directories of the chunks of a trace; a single one unless it is rotated."""
        scheme, number, name = buffering
        place = f"ust/uid/{number}/64-bit"
        if scheme == "pid":
            place = f"ust/pid/{name}-{number}-{_date(self._identity.epoch_ns):%Y%m%d-%H%M%S}"
        for number in range(len(self._recording.snapshots)):
            yield base / f"snapshot-1-{number}" / place
        if not self._recording.rotations:
            yield base / place
            return
        times = (self._recording.start_ns, *self._recording.rotations)
        for ordinal, begin in enumerate(times):
            end = times[ordinal + 1] if ordinal + 1 < len(times) else begin
            span = "-".join(
                f"{_date(self._identity.epoch_ns + time):%Y%m%dT%H%M%S+0000}"
                for time in (begin, end)
            )
            yield base / "archives" / f"{span}-{ordinal}" / place

    def _ending(self, cpu: int) -> Ending | None:
        recording = self._recording
        if cpu < recording.cut_streams:
            return Ending(is_last_packet_cut=True)
        if cpu < recording.cut_streams + recording.unfinished_streams:
            return Ending(is_last_packet_missing=True)
        return None


def _date(ns: int) -> datetime:
    return datetime.fromtimestamp(ns // 1_000_000_000, timezone.utc)
