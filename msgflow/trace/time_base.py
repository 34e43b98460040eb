"""Time base of the traces of one boot.

A tracer measures how far its clock is from the epoch for every trace anew, with buffers per process
for every process. The clock itself is the same for all traces of a boot, as its uuid says: what the
offsets differ by is an error of measuring or, between sessions, what the time of day was set by
meanwhile. An error of measuring is left alone, so that times are those that the trace says and that
every other reader shows. That a clock was set is undone: times of one host have to fit together.

Time namespaces and clones of a machine have the boot of another one, and a clock of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from msgflow.trace.model import TraceInfo

# Uuid and name of a clock.
ClockName = tuple[str, str | None]
GIGA = 1_000_000_000
# LTTng reads the two clocks next to each other, several times, and takes the best: some ns, or some
# hundred where reading a clock needs the kernel.
GREATEST_ERROR_NS = 1_000


def on_one_base(
    traces: Sequence[TraceInfo], offsets: dict[ClockName, int]
) -> tuple[TraceInfo, ...]:
    """Return the descriptions of traces with corrections, so that times of each boot fit together.

    The first trace of programs decides. The kernel's decides only where there is no other, so that
    a kernel trace beside a recording moves no time of the recording. Only a clock that has a uuid
    and counts nanoseconds is corrected: without a uuid it is a clock of its own. Two hostnames with
    one boot id that overlap as recorded, but not after the correction, are two machines (a clone):
    the clock that would be corrected loses its uuid.

    `offsets` are what traces opened before decided, in ns since the epoch. The function adds those
    of these traces.
    """
    for trace in sorted(traces, key=lambda trace: trace.domain == "kernel"):
        if trace.clock_uuid is not None and trace.clock_frequency == GIGA:
            clock = trace.clock_uuid, trace.clock_name
            offsets.setdefault(clock, trace.clock_offset_ns)
    corrected = [_corrected(trace, offsets) for trace in traces]
    strangers = _at_one_time(traces) - _at_one_time(corrected)
    return tuple(
        replace(trace, clock_uuid=None)
        if on_base.clock_correction_ns and _host(trace) in strangers
        else on_base
        for trace, on_base in zip(traces, corrected, strict=True)
    )


def _host(trace: TraceInfo) -> tuple[str | None, str | None]:
    return trace.clock_uuid, trace.hostname


def _at_one_time(traces: Sequence[TraceInfo]) -> set[tuple[str | None, str | None]]:
    """Return the hosts that recorded while another one of their boot did."""
    times: dict[tuple[str | None, str | None], list[int]] = {}
    for trace in traces:
        if trace.begin_ns is not None and trace.end_ns is not None:
            times.setdefault(_host(trace), []).extend((trace.begin_ns, trace.end_ns))
    return {
        host
        for host, own in times.items()
        for other, its in times.items()
        if host != other and host[0] == other[0] and min(own) <= max(its) and min(its) <= max(own)
    }


def _corrected(trace: TraceInfo, offsets: dict[ClockName, int]) -> TraceInfo:
    if trace.clock_uuid is None or trace.clock_frequency != GIGA:
        return trace
    correction = offsets[trace.clock_uuid, trace.clock_name] - trace.clock_offset_ns
    if abs(correction) <= GREATEST_ERROR_NS:
        return trace
    return replace(
        trace,
        clock_correction_ns=correction,
        begin_ns=None if trace.begin_ns is None else trace.begin_ns + correction,
        end_ns=None if trace.end_ns is None else trace.end_ns + correction,
    )
