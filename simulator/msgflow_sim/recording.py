"""Recording: how a system is recorded, as data without behaviour. The default is perfect."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from msgflow.errors import UsageError


class Buffers(Enum):
    """Where LTTng keeps what processes emit: one trace per user, or one per process."""

    PER_USER = "uid"
    PER_PROCESS = "pid"


@dataclass(frozen=True, slots=True)
class Recording:
    """What becomes of the events of every host. Times are ns since the begin of the scenario.

    Attributes:
        start_ns: recording starts then; what happened before is not in the trace.
        is_dual_session: a second session, `snapshot`, has the initialisation events from before
            `start_ns`; the one that starts then is `runtime`.
        pauses: recording is stopped and started again at these times.
        rotations: the trace is continued in a further chunk of the archive from these times on;
            within a pause, when that ends.
        snapshots: at these times what is in the buffers is recorded, and nothing else is.
        kept_packets: so many packets of each stream the buffers of snapshots hold.
        is_last_snapshot_only: the others were recorded too, but are not there.
        missing_chunk: which chunk is not there, counted from 1 behind the first; 0: all are.
        buffers: one trace per user, or one per process.
        flush_ns: a timer of the tracer ends packets that are not empty, at this distance; 0: none
            does.
        handover_ns: the tracer tells one process after the other that recording starts or stops;
            within this time after each start they join it, before each stop they leave it.
        losses: all CPUs lose what happens between these times, and count it.
        clock_error_ns: the epoch offsets of the traces of one host differ by up to this much:
            those of processes, or that of the snapshot from that of the rest.
        lost_event_share: behind this share (0..1) of the packets, events are lost for a while.
        longest_loss: how many events are lost at most at once.
        filled_share: behind this share (0..1) of the packets with a loss, the loss lies between
            packets: they are filled to the last byte, and the next waits until there is room.
        lossy_cpus: only on these CPUs events are lost; on all if there are none.
        packet_bytes: size of a full packet; 0: as is usual in the layout.
        lost_packet_share: this share of the packets is missing.
        cut_streams: so many streams of each trace end in the middle of a packet.
        unfinished_streams: so many others lack their last packet.
        realtime_offset_ns: what the clock that makes source stamps is ahead of the trace's clock
            at the begin.
        slew_ppm: parts per million by which it is faster than the trace's clock.
        realtime_steps: it is set: at these times, forward by so much.
        kernel_tracer: what records the kernel, if anything does: 'lttng' or 'perf'.
    """

    start_ns: int = 0
    is_dual_session: bool = False
    pauses: tuple[tuple[int, int], ...] = ()
    rotations: tuple[int, ...] = ()
    snapshots: tuple[int, ...] = ()
    kept_packets: int = 4
    is_last_snapshot_only: bool = False
    missing_chunk: int = 0
    buffers: Buffers = Buffers.PER_USER
    flush_ns: int = 0
    handover_ns: int = 0
    losses: tuple[tuple[int, int], ...] = ()
    clock_error_ns: int = 0
    lost_event_share: float = 0.0
    longest_loss: int = 200
    filled_share: float = 0.0
    lossy_cpus: tuple[int, ...] = ()
    packet_bytes: int = 0
    lost_packet_share: float = 0.0
    cut_streams: int = 0
    unfinished_streams: int = 0
    realtime_offset_ns: int = 0
    slew_ppm: float = 0.0
    realtime_steps: tuple[tuple[int, int], ...] = ()
    kernel_tracer: str = field(default="lttng", repr=False)

    def __post_init__(self) -> None:
        for share in (self.lost_event_share, self.lost_packet_share, self.filled_share):
            if not 0 <= share <= 1:
                raise UsageError(f"not a share — {share}", "give a number between 0 and 1")
        if self.kernel_tracer not in {"lttng", "perf"}:
            raise UsageError(
                f"unknown tracer of the kernel — {self.kernel_tracer}", "choose lttng or perf"
            )
        if not abs(self.slew_ppm) < 1000:
            raise UsageError(
                f"no clock runs {self.slew_ppm} ppm too fast", "give less than 1000 ppm"
            )
        amounts = (self.start_ns, self.cut_streams, self.unfinished_streams, self.clock_error_ns)
        if min(*amounts, self.handover_ns, self.flush_ns) < 0:
            raise UsageError("a negative time or count makes no sense", "give 0 or more")
        if not 0 <= self.missing_chunk <= len(self.rotations):
            raise UsageError(
                f"there is no chunk {self.missing_chunk} behind the first",
                "give one number of a rotation",
            )
        if self.longest_loss < 1:
            raise UsageError("a loss takes at least one event", "give 1 or more")
        if self.snapshots and (self.kept_packets < 1 or self.rotations or self.is_dual_session):
            raise UsageError(
                "snapshots need packets to keep, and go with no rotation and no dual session",
                "give a number of packets, and snapshots alone",
            )
        self._check_times()
        if self.is_dual_session and (self.start_ns == 0 or self.buffers is Buffers.PER_PROCESS):
            raise UsageError(
                "a dual session needs a late start and buffers per user",
                "give the time at which the second session starts",
            )

    def _check_times(self) -> None:
        for name, stretches in (("pause", self.pauses), ("loss", self.losses)):
            if bad := [stretch for stretch in stretches if stretch[0] >= stretch[1]]:
                raise UsageError(
                    f"a {name} must end after it has begun — {bad[0]}", "give its begin first"
                )
        previous = self.start_ns
        apart = (
            (time, time)
            for time in (*self.rotations, *self.snapshots)
            if not any(begin < time < end for begin, end in self.pauses)
        )
        for begin, end in sorted((*self.pauses, *apart)):
            if begin <= previous:
                raise UsageError(
                    "pauses and rotations must follow the start and each other",
                    "give times that do not overlap or touch",
                )
            previous = end

    @property
    def is_perfect(self) -> bool:
        """Whether every event of the layout is recorded, by one trace of each host."""
        return self == Recording(
            realtime_offset_ns=self.realtime_offset_ns,
            slew_ppm=self.slew_ppm,
            realtime_steps=self.realtime_steps,
            kernel_tracer=self.kernel_tracer,
        )


PERFECT = Recording()
