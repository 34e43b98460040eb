"""Reads traces whole, to compare what two readers make of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa

import msgflow.trace
from msgflow.trace import PACKET, Damage, TraceInfo


@dataclass(frozen=True)
class Content:
    """Everything a reader delivers."""

    traces: tuple[TraceInfo, ...]
    schemas: Mapping[str, pa.Schema]
    rows: Mapping[str, list[dict[str, Any]]]
    event_counts: Mapping[tuple[int, str], int]
    duplicate_packet_count: int
    damages: tuple[Damage, ...]


def read(*paths: Path, reader: str = "msgflow", **options: Any) -> Content:
    """Read; packets come in the order of their streams."""
    parts: dict[str, list[pa.RecordBatch]] = {}
    with msgflow.trace.open(paths, reader=reader) as traces:
        for item in traces.batches(**options):
            parts.setdefault(item.name, []).append(item.batch)
        rows = {
            name: [row for part in of_name for row in _rows(part)]
            for name, of_name in parts.items()
        }
        rows.get(PACKET, []).sort(key=lambda row: row[:2] + row[5:6])
        return Content(
            traces.traces,
            {name: of_name[0].schema for name, of_name in parts.items()},
            rows,
            dict(traces.event_counts),
            traces.duplicate_packet_count,
            tuple(traces.damages),
        )


def _rows(batch: pa.RecordBatch) -> list[Any]:
    """Return rows as tuples: two columns may have the same name.

    Without the numbers of packets, which Babeltrace keeps to itself.
    """
    columns = [
        column.to_pylist()
        for name, column in zip(batch.schema.names, batch.columns, strict=True)
        if name != "is_numbered"
    ]
    return list(zip(*columns, strict=True))


def differences(ours: Content, theirs: Content) -> list[str]:
    """Say in what two contents differ."""
    found = []
    for what in ("traces", "event_counts", "duplicate_packet_count", "schemas"):
        one, other = getattr(ours, what), getattr(theirs, what)
        if one != other:
            found.append(f"{what}: {one} and {other}")
    for name in ours.schemas.keys() & theirs.schemas.keys():
        # Two schemas are equal also where their metadata are not.
        one, other = ([field.metadata for field in c.schemas[name]] for c in (ours, theirs))
        if one != other:
            found.append(f"metadata of {name}: {one} and {other}")
    for name in sorted({*ours.rows, *theirs.rows}):
        one, other = ours.rows.get(name, []), theirs.rows.get(name, [])
        if len(one) != len(other):
            found.append(f"{name}: {len(one)} and {len(other)} rows")
        # Damaged numbers may be no numbers, which equal nothing: their words do.
        pairs = [pair for pair in zip(one, other, strict=False) if pair[0] != pair[1]]
        found += [f"{name}: {a} and {b}" for a, b in pairs if repr(a) != repr(b)][:3]
    return found
