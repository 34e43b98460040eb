"""Recordings among the traces below some paths: which of them become one run.

Traces of one session belong together, also those of an archive in its folder. So do sessions with a
trace in common (the chunks of a rotation, snapshots), and sessions whose times overlap: their hosts
may have sent each other messages. A session that records no initialisation belongs to the one
before it that does (dual sessions). A kernel trace belongs to the sessions of ROS that are nearest
to its folder.
"""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from msgflow import trace as trace_package
from msgflow.ingest.hostnames import hostnames_of
from msgflow.trace import TraceInfo, archive

# What LTTng makes below the folder of a session: buffers by user or by process, and chunks.
_OF_LTTNG = re.compile(
    r"((/archives/[^/]+)?(/(ust|kernel)(/(uid|pid)(/[^/]+(/(32|64)-bit)?)?)?)+)+$"
)


@dataclass(frozen=True)
class Recording:
    """Traces that become one run."""

    paths: Sequence[str | Path]  # that have all of them below, and no others
    hosts: Mapping[str, Sequence[str | Path]]  # name of a host -> paths of its traces


def session_folder(path: str | Path) -> Path:
    """Return the folder of the session that a path of a trace, or of a part of one, belongs to."""
    real = os.path.realpath(path)
    return Path(_OF_LTTNG.sub("", real) or real)


def find_recordings(
    paths: Sequence[str | Path], hosts: Mapping[str, Sequence[str]], *, reader: str = "auto"
) -> list[Recording]:
    """Return the recordings below some paths, the first in time first."""
    roots = [Path(os.path.realpath(path)) for path in paths]
    whole = [Recording(paths, hosts)]
    if "" in paths:  # An ingest refuses it; here it would be the current directory.
        return whole
    archives = [root for root in roots if archive.is_archive(root)]
    if archives:
        is_one = len(set(roots)) == 1
    else:
        found = trace_package.discover(paths)
        is_one = len({session_folder(location.path) for location in found}) == 1
    if is_one:
        return whole
    with trace_package.open(paths, reader=reader) as opened:
        traces = opened.traces
    named = hostnames_of(traces, hosts)
    sessions: dict[Path, list[TraceInfo]] = {}
    folders = {session_folder(trace.path) for trace in traces}
    for trace in traces:
        file = _archive_of(trace, archives)
        folder = session_folder(file.parent if file else trace.path)
        # An archive in the folder of a session is a part of it, and else a session of its own.
        session = file if file and folder not in folders else folder
        sessions.setdefault(session, []).append(trace)
    apart = _by_trace(list(sessions.values()))
    of_kernel = [group for group in apart if {trace.domain for trace in group} == {"kernel"}]
    of_ros = [group for group in apart if group not in of_kernel]
    groups = _with_kernel(_by_initialisation(_by_time(of_ros)), of_kernel)
    if len(groups) == 1:
        return whole
    return [
        Recording(_paths(group, traces, roots, archives), _hosts(group, named)) for group in groups
    ]


def _archive_of(trace: TraceInfo, archives: Sequence[Path]) -> Path | None:
    return next((file for file in archives if trace.path.is_relative_to(file)), None)


def _by_trace(groups: Sequence[list[TraceInfo]]) -> list[list[TraceInfo]]:
    joined: list[list[TraceInfo]] = []
    for group in groups:
        uuids = {trace.uuid for trace in group} - {None}
        alike = [other for other in joined if uuids & {trace.uuid for trace in other}]
        joined = [other for other in joined if other not in alike]
        joined.append([*itertools.chain(*alike), *group])
    return joined


def _by_time(groups: Sequence[list[TraceInfo]]) -> list[list[TraceInfo]]:
    """Join the groups whose times overlap; one without any event goes with the first."""
    joined: list[list[TraceInfo]] = []
    latest = 0
    for group in sorted(groups, key=_begin):
        if joined and _begin(group) <= latest:
            joined[-1] += group
        else:
            joined.append(list(group))
        latest = max(latest, *(trace.end_ns or 0 for trace in _timed(group)))
    return joined


def _by_initialisation(groups: Sequence[list[TraceInfo]]) -> list[list[TraceInfo]]:
    """Join the groups that record no initialisation with the last one before that does."""
    joined: list[list[TraceInfo]] = []
    for group in groups:
        clocks = {trace.clock_uuid for trace in group}
        owners = [
            other
            for other in joined
            if _records_initialisation(other) and clocks & {trace.clock_uuid for trace in other}
        ]
        if owners and not _records_initialisation(group):
            owners[-1] += group
        else:
            joined.append(list(group))
    return joined


def _with_kernel(
    groups: Sequence[list[TraceInfo]], of_kernel: Sequence[list[TraceInfo]]
) -> list[list[TraceInfo]]:
    """Join kernel traces with the nearest group; where there are several, with those of their time.

    Times of perf count from the boot, so that they tell nothing where folders do.
    """
    joined = list(groups)
    for kernel in of_kernel:
        of_ros = [group for group in joined if {trace.domain for trace in group} != {"kernel"}]
        near = _nearest(of_ros, session_folder(kernel[0].path))
        if len(near) > 1:
            near = [group for group in near if len(_by_time([group, kernel])) == 1]
        place = min((joined.index(group) for group in near), default=len(joined))
        joined = [group for group in joined if group not in near]
        joined.insert(place, [*itertools.chain(*near), *kernel])
    return joined


def _nearest(groups: Sequence[list[TraceInfo]], folder: Path) -> list[list[TraceInfo]]:
    """Return the groups with a trace below the lowest folder around this one that has any."""
    for around in (folder, *folder.parents):
        below = [
            group for group in groups if any(trace.path.is_relative_to(around) for trace in group)
        ]
        if below:
            return below
    return []


def _records_initialisation(group: Sequence[TraceInfo]) -> bool:
    return any("ros2:rcl_node_init" in trace.event_names for trace in group)


def _begin(group: Sequence[TraceInfo]) -> int:
    begins = [trace.begin_ns for trace in _timed(group) if trace.begin_ns is not None]
    return min(begins, default=0)


def _timed(group: Sequence[TraceInfo]) -> Sequence[TraceInfo]:
    """Return the traces whose times tell when a group was recorded: perf counts from the boot."""
    return [trace for trace in group if trace.domain == "ust"] or group


def _paths(
    group: Sequence[TraceInfo],
    traces: Sequence[TraceInfo],
    roots: Collection[Path],
    archives: Sequence[Path],
) -> tuple[Path, ...]:
    """Return the archives of a group, and the highest given folders that hold no other group.

    A link in a given folder may lead out of it: then there is no such folder but that of the trace.
    """
    others = [trace.path for trace in traces if trace not in group]

    def is_own(folder: Path) -> bool:
        return any(map(folder.is_relative_to, roots)) and not any(
            other.is_relative_to(folder) for other in others
        )

    def highest(folder: Path) -> Path:
        return next((above for above in reversed(folder.parents) if is_own(above)), folder)

    return tuple(
        dict.fromkeys(_archive_of(trace, archives) or highest(trace.path) for trace in group)
    )


def _hosts(group: Sequence[TraceInfo], named: Mapping[int, str]) -> dict[str, list[Path]]:
    hosts: dict[str, list[Path]] = {}
    for trace in group:
        if trace.index in named:
            hosts.setdefault(named[trace.index], []).append(trace.path)
    return hosts
