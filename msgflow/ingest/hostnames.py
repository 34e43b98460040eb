"""Hostnames that the user gives to traces, by the paths above them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from msgflow.errors import TraceError, UsageError
from msgflow.trace import TraceInfo


def hostnames_of(
    traces: Sequence[TraceInfo], hosts: Mapping[str, str | Path | Sequence[str | Path]]
) -> dict[int, str]:
    """Return the name of each trace for which one is given: that of the deepest path above it."""
    # By path: the name that belongs to it, and the path as it was given.
    given: dict[Path, tuple[str, str | Path]] = {}
    for name, paths in hosts.items():
        for path in [paths] if isinstance(paths, str | Path) else paths:
            other, _ = given.setdefault(Path(os.path.realpath(path)), (name, path))
            if other != name:
                raise UsageError(
                    f"two names are given for the host of one path: {other} and {name} — {path}",
                    "leave out one of the two",
                )
    names: dict[int, str] = {}
    used: set[Path] = set()
    for trace in traces:
        above = [path for path in (trace.path, *trace.path.parents) if path in given]
        if above:
            names[trace.index] = given[above[0]][0]
            used.add(above[0])
    for root, (name, path) in given.items():
        if root in used:
            continue
        if any(root in trace.path.parents for trace in traces):
            raise UsageError(
                f"other hosts have all traces below the path given for host {name} — {path}",
                "leave it out, or leave out one of the deeper paths",
            )
        raise TraceError(
            f"none of the traces lies below the path given for host {name} — {path}",
            "give --host NAME=PATH with a directory that holds traces of this ingest",
        )
    return names
