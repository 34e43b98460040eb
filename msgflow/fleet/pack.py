"""Packs: answers and views of many runs in few, large files. What no run needs is deleted.

It works offline. All packs count from the moment when the file with the rows of all runs is there;
until then all runs are as they were, so that an end in between does no harm.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from msgflow.errors import DatabaseError
from msgflow.fleet import layout
from msgflow.fleet.file_store import Entry
from msgflow.fleet.lake import Lake
from msgflow.fleet.layout import read_parquet
from msgflow.fleet.part import ANSWERS
from msgflow.sql.failure import first_line
from msgflow.version import __version__

# Size of one pack: each of its tables is held in memory, and it is written again when one of its
# runs is removed.
_MOST_RUNS = 1_000
_MOST_BYTES = 50_000_000
_READ_AT_ONCE = 16


@dataclass(frozen=True)
class Packed:
    """What was packed."""

    runs: int  # runs whose answers or views are in a new part now
    packs: int  # new parts
    deleted: int  # deleted files
    size: int  # their bytes


def pack(lake: Lake) -> Packed:
    """Put answers and views of many runs together, and delete files that no run needs.

    No other process may use the lake meanwhile.
    """
    with lake.writing(alone=True):
        packed = {row["run"]: row for row in lake.runs().to_pylist()}
        before = dict(packed)
        packs = 0
        views = sorted(
            {entry.path.rpartition("/")[0] for entry in lake.store.entries(layout.VIEWS)}
        )
        for key, tables in (("part", [*ANSWERS]), ("view_part", views)):
            sizes = Counter[str]()
            for table in tables:
                for entry in lake.store.entries(table):
                    sizes[layout.part_of(entry.path) or ""] += entry.size
            for group in _groups(list(packed.values()), key, sizes):
                part = _pack(lake, group, key, tables)
                packed |= {row["run"]: {**row, key: part} for row in group}
                packs += 1
        changed = sum(packed[run] != before[run] for run in packed)
        own = {layout.run_path(key) for key in packed}
        if packs or own.intersection(entry.path for entry in lake.store.entries(layout.RUN)):
            lake.pack_runs(list(packed.values()))
        # Without a run, no row is left to keep.
        deleted = _clean_up(lake, own or {layout.run_path(layout.PACKED)}, packed.values())
    return Packed(changed, packs, len(deleted), sum(entry.size for entry in deleted))


def _groups(
    runs: Sequence[Mapping[str, Any]], key: str, sizes: Mapping[str, int]
) -> list[list[Mapping[str, Any]]]:
    """Return groups of runs, each of one version, whose files are to go into one part.

    `key` is the column of `run` that names the part: that of the answers, or of the views.
    """
    living = Counter(row[key] for row in runs if row[key] is not None)
    full = {
        part
        for part in living
        if living[part] == layout.packed_runs(part)
        and (living[part] > _MOST_RUNS // 2 or sizes[part] > _MOST_BYTES // 2)
    }
    loose = [row for row in runs if row[key] is not None and row[key] not in full]
    loose.sort(key=lambda row: (*_version(row), row["start_ns"] or 0, row["run"]))
    groups: list[list[Mapping[str, Any]]] = [[]]
    size = 0.0
    for row in loose:
        share = sizes[row[key]] / living[row[key]]
        last = groups[-1]
        if last and (
            size + share > _MOST_BYTES
            or len(last) == _MOST_RUNS
            or _version(last[-1]) != _version(row)
        ):
            groups.append([])
            size = 0.0
        groups[-1].append(row)
        size += share
    # In several parts, or in one with runs that are gone.
    return [
        group
        for group in groups
        if len(parts := {row[key] for row in group}) > 1
        or any(layout.packed_runs(part) > living[part] for part in parts)
    ]


def _version(row: Mapping[str, Any]) -> tuple[str, str]:
    return row["schema_revision"] or "", row["msgflow_version"] or ""


def _pack(lake: Lake, rows: Sequence[Mapping[str, Any]], key: str, tables: Sequence[str]) -> str:
    part = layout.new_pack(len(rows))
    for table in tables:
        whole = _together(lake, table, rows, key, part)
        if whole is not None:
            revision = rows[0]["schema_revision"] or ""
            lake.put_table(layout.part_path(table, part), table.rpartition("/")[2], whole, revision)
    return part


def _together(
    lake: Lake, table: str, rows: Sequence[Mapping[str, Any]], key: str, pack: str
) -> pa.Table | None:
    """Return the rows of some runs, run after run; None if no part has the table."""
    wanted: dict[str, list[str]] = {}
    for row in rows:
        wanted.setdefault(row[key], []).append(row["run"])
    with ThreadPoolExecutor(_READ_AT_ONCE) as pool:
        read = pool.map(lambda part: _read(lake, table, part, wanted[part]), wanted)
        found = dict(zip(wanted, read, strict=True))
    there = {part: rows for part, rows in found.items() if rows is not None}
    # Those of an earlier msgflow may all lack the table, and views may be of another one.
    if not there and (key != "part" or rows[0]["msgflow_version"] != __version__):
        return None
    for part, runs in wanted.items():
        if part not in there:
            raise _unusable(lake, table, part, runs, "it is missing")
        first = next(iter(there))
        if there[part].schema != there[first].schema:
            other = lake.store.url_of(layout.part_path(table, first))
            raise _unusable(lake, table, part, runs, f"it differs from {other}")
    whole = pa.concat_tables(there.values())
    names = pa.repeat(pa.scalar(pack), len(whole))
    whole = whole.set_column(whole.column_names.index("part"), "part", names)
    # The sort is stable: the rows of a run keep their order.
    return whole.take(pc.sort_indices(whole["run"]))


def _read(lake: Lake, table: str, part: str, runs: Sequence[str]) -> pa.Table | None:
    content = lake.store.read(layout.part_path(table, part))
    if content is None:
        return None
    try:
        read = read_parquet(content)
        is_wanted = pc.is_in(read["run"], value_set=pa.array(runs, pa.string()))
        return read.filter(pc.and_(is_wanted, pc.equal(read["part"], part)))
    except (pa.ArrowException, KeyError, OSError) as error:
        raise _unusable(lake, table, part, runs, first_line(error)) from error


def _unusable(lake: Lake, table: str, part: str, runs: Sequence[str], why: str) -> DatabaseError:
    url = lake.store.url_of(layout.part_path(table, part))
    return DatabaseError(
        f"a file of the lake cannot be used: {why} — {url}",
        f"{shlex.join(['msgflow', 'fleet', 'remove', runs[0], '--lake', lake.store.url])};"
        " ingest it again",
    )


def _clean_up(lake: Lake, own: set[str], runs: Iterable[Mapping[str, Any]]) -> list[Entry]:
    """Delete the runs' own files of the table `run`, then the files of parts that no run names."""
    unneeded = [
        entry
        for entry in lake.store.entries(layout.RUN)
        if entry.path in own or layout.part_of(entry.path) == ""
    ]
    needed = {
        **{table: {row["part"] for row in runs} for table in ANSWERS},
        layout.VIEWS: {row["view_part"] for row in runs},
        layout.DATABASE: {row["database_part"] for row in runs},
    }
    for folder, parts in needed.items():
        unneeded += [
            entry
            for entry in lake.store.entries(folder)
            if (part := layout.part_of(entry.path)) is not None and part not in parts
        ]
    # `remove` leaves a file here, also where it took out the last run.
    if unneeded and not lake.names():
        raise DatabaseError(
            f"the lake has answers, but no run — {lake.store.url_of(layout.RUN)}",
            "is its file system mounted? If an ingest was killed, start that again",
        )
    # The file without a row last: without it, the rest would look like a lake that is not mounted.
    unneeded.sort(key=lambda entry: entry.path == layout.run_path(layout.PACKED))
    for entry in unneeded:
        lake.store.delete(entry.path)
    return unneeded
