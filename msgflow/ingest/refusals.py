"""Refusals of traces that say nothing about a ROS 2 system, with the reason."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from msgflow.errors import TraceError
from msgflow.ingest.catalogue import load
from msgflow.trace import Damage, TraceInfo

_SHOWN = 5


def require_ros_traces(traces: Sequence[TraceInfo]) -> None:
    """Raise unless the traces declare ROS 2 events with the contexts that msgflow needs.

    Only the metadata counts: no event has been read yet.
    """
    for trace in traces:
        if not trace.has_time:
            raise TraceError(
                f"the events have no time stamps — {trace.path}",
                "record with LTTng or ros2_tracing; `msgflow events` lists what the trace has",
            )
    ros = [trace for trace in traces if _ros_events(trace.event_names)]
    if not ros:
        if traces and all(trace.domain == "kernel" for trace in traces):
            raise TraceError(
                f"only a kernel trace, without ROS 2 events — {traces[0].path}",
                "give the whole session directory; ROS 2 events are in its ust/ directory",
            )
        declared = sorted({name for trace in traces for name in trace.event_names})
        raise TraceError(
            f"no ROS 2 events, the trace declares {_listed(declared)} — {_paths(traces)}",
            "record with `ros2 trace` until the nodes have started; if that was done, tracetools "
            "was built without LTTng (binary packages before Iron are): rebuild it from source "
            "with lttng-ust installed",
        )
    for trace in ros:
        if not trace.has_process_context:
            raise TraceError(
                f"the events do not say which process and thread they come from — {trace.path}",
                "record with the contexts vpid, vtid and procname "
                "(`ros2 trace` adds them; else `lttng add-context -u -t vpid -t vtid -t procname`)",
            )


def require_ros_events(
    traces: Sequence[TraceInfo], counts: Mapping[tuple[int, str], int], damages: Sequence[Damage]
) -> None:
    """Raise unless at least one event that msgflow knows was read."""
    total: Counter[str] = Counter()
    for (_, name), count in counts.items():
        total[name] += count
    if _ros_events(total):
        return
    found = _listed([f"{name} ({count:,})" for name, count in total.most_common()])
    if damages:
        first = damages[0]
        more = f" and {len(damages) - 1:,} more damages" if len(damages) > 1 else ""
        raise TraceError(
            f"no ROS 2 event could be read, the trace is damaged: {first.message} — "
            f"{first.file}, packet {first.position}, byte {first.offset}{more}",
            "copy it again from where it was recorded, with metadata and all streams",
        )
    raise TraceError(
        f"no ROS 2 event was recorded, the trace holds {found} — {_paths(traces)}",
        "start tracing before the ROS 2 system, until its nodes have started, and record as the "
        "user who runs it; if that was done, tracetools was built without LTTng (binary packages "
        "before Iron are)",
    )


def _ros_events(names: Sequence[str] | Mapping[str, int]) -> list[str]:
    known = {name for name, tracepoint in load().tracepoints.items() if not tracepoint.is_kernel}
    return [name for name in names if name in known]


def _listed(names: Sequence[str]) -> str:
    if not names:
        return "nothing"
    more = len(names) - _SHOWN
    text = ", ".join(names[:_SHOWN])
    return text if more <= 0 else f"{text} and {more} more"


def _paths(traces: Sequence[TraceInfo]) -> str:
    return _listed([str(trace.path) for trace in traces])
