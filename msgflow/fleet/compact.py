"""Compaction of a lake: fewer, larger files, and no unused ones; readers and writers go on."""

from __future__ import annotations

import itertools
import secrets
import shlex
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from msgflow.errors import DatabaseError
from msgflow.fleet.answers import answers
from msgflow.fleet.lake import Lake, visible
from msgflow.fleet.layout import DATABASE, RUN, VIEWS, is_file_of_part, metadata, part_path
from msgflow.fleet.parquet import read_parquet
from msgflow.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import pyarrow as pa

    from msgflow.fleet.file_store import Entry

PACK = "pack"
# Size of one pack: it is held in memory, and written again when one of its runs is removed.
_MOST_RUNS = 1_000
_MOST_BYTES = 50_000_000
# Small groups of rows, run after run: a query of few runs reads few groups.
_ROW_GROUP = 20_000
_READ_AT_ONCE = 16
DAY = 86_400.0


@dataclass(frozen=True)
class Compaction:
    """The result of a compaction.

    Attributes:
        packed: runs whose answers are in a new part now.
        packs: new parts.
        deleted: deleted files.
        size: their bytes.
    """

    packed: int
    packs: int
    deleted: int
    size: int


def compact(lake: Lake, *, older_than: float = DAY) -> Compaction:
    """Put the answers of many runs together, and delete files that no row of `run` needs.

    Readers and writers may go on: files that they may still use stay for `older_than`.
    """
    rows = lake.rows()
    sizes = Counter[str]()
    for answer in answers():
        for entry in lake.store.entries(answer.table):
            sizes[_part_of(entry) or ""] += entry.size
    packed, packs = 0, 0
    for chosen in _groups(rows, sizes):
        _pack(lake, chosen)
        packed += len(chosen)
        packs += 1
    lake.put_together()
    deleted = _clean_up(lake, older_than)
    return Compaction(packed, packs, len(deleted), sum(entry.size for entry in deleted))


def _groups(rows: pa.Table, sizes: Mapping[str, int]) -> list[list[dict[str, Any]]]:
    """Return groups of runs whose answers are to go into one part."""
    runs = [row for row in visible(rows).to_pylist() if row["part"] is not None]
    living = Counter(row["part"] for row in runs)
    named = Counter(part for _, part in {(row["run"], row["part"]) for row in rows.to_pylist()})
    full = {
        part
        for part in living
        if part.startswith(PACK)
        and living[part] == named[part]
        and (living[part] > _MOST_RUNS // 2 or sizes[part] > _MOST_BYTES // 2)
    }
    loose = [row for row in runs if row["part"] not in full]
    loose.sort(key=lambda row: (row["schema_revision"] or "", row["start_ns"] or 0, row["run"]))
    groups: list[list[dict[str, Any]]] = [[]]
    size = 0.0
    for row in loose:
        share = sizes[row["part"]] / living[row["part"]]
        if groups[-1] and (size + share > _MOST_BYTES or len(groups[-1]) == _MOST_RUNS):
            groups.append([])
            size = 0.0
        groups[-1].append(row)
        size += share
    return [group for group in groups if _is_worth_it(group, living, named)]


def _is_worth_it(
    group: Sequence[Mapping[str, Any]], living: Mapping[str, int], named: Mapping[str, int]
) -> bool:
    """Tell whether runs are in several parts, or in one with runs that are gone."""
    parts = {row["part"] for row in group}
    return len(parts) > 1 or any(
        part.startswith(PACK) and named[part] > living[part] for part in parts
    )


def _pack(lake: Lake, rows: Sequence[Mapping[str, Any]]) -> None:
    part = f"{PACK}-{secrets.token_hex(8)}"
    revision = max(row["schema_revision"] or "" for row in rows)
    for answer in answers():
        table = _together(lake, answer.table, rows)
        if table is not None:
            _write(lake, answer.table, part, table, revision)
    # The generation stays: a run that is replaced or removed meanwhile has a higher one.
    lake.commit({**row, "part": part} for row in rows)


def _together(lake: Lake, table: str, rows: Sequence[Mapping[str, Any]]) -> pa.Table | None:
    """Return the answers of some runs, run after run; None if no part has the table."""
    import pyarrow as pa
    import pyarrow.compute as pc

    wanted: dict[str, list[str]] = {}
    for row in rows:
        wanted.setdefault(row["part"], []).append(row["run"])
    ours = {row["part"] for row in rows if row["msgflow_version"] == __version__}
    with ThreadPoolExecutor(_READ_AT_ONCE) as pool:
        found = dict(
            zip(
                wanted,
                pool.map(lambda part: _read(lake, table, part, wanted[part]), wanted),
                strict=True,
            )
        )
    there = {part: read for part, read in found.items() if read is not None}
    # A part of an earlier msgflow may lack the table.
    for part in sorted(ours - set(there)):
        raise _unusable(lake, table, part, wanted[part], "it is missing")
    if not there:
        return None
    schema = pa.schema([])
    # What this msgflow wrote comes first: what differs from it is at fault.
    order = sorted(there, key=lambda part: part not in ours)
    for part in order:
        try:
            schema = pa.unify_schemas([schema, there[part].schema], promote_options="permissive")
        except pa.ArrowException as error:
            first = lake.store.url_of(part_path(table, order[0]))
            raise _unusable(lake, table, part, wanted[part], f"it differs from {first}") from error
    whole = pa.concat_tables(there.values(), promote_options="permissive")
    # The sort is stable: the rows of a run keep their order.
    return whole.take(pc.sort_indices(whole["run"]))


def _read(lake: Lake, table: str, part: str, runs: Sequence[str]) -> pa.Table | None:
    import pyarrow as pa
    import pyarrow.compute as pc

    content = lake.store.read(part_path(table, part))
    if content is None:
        return None
    with _usable(lake, table, part, runs):
        read = read_parquet(content)
        return read.filter(pc.is_in(read["run"], value_set=pa.array(runs, pa.string())))


@contextmanager
def _usable(lake: Lake, table: str, part: str, runs: Sequence[str]) -> Iterator[None]:
    """Turn errors of the content of a file into a DatabaseError that names it."""
    import pyarrow as pa

    try:
        yield
    except (pa.ArrowException, KeyError, OSError) as error:
        words = (str(error).strip().splitlines() or [type(error).__name__])[0]
        raise _unusable(lake, table, part, runs, words) from error


def _unusable(lake: Lake, table: str, part: str, runs: Sequence[str], why: str) -> DatabaseError:
    return DatabaseError(
        f"a file of the lake cannot be used: {why} — {lake.store.url_of(part_path(table, part))}",
        f"{shlex.join(['msgflow', 'fleet', 'remove', runs[0], '--lake', lake.store.url])};"
        " ingest it again",
    )


def _write(lake: Lake, name: str, part: str, table: pa.Table, revision: str) -> None:
    import pyarrow as pa
    import pyarrow.parquet

    sink = pa.BufferOutputStream()
    pyarrow.parquet.write_table(
        table.replace_schema_metadata(metadata(name, revision)),
        sink,
        compression="zstd",
        row_group_size=_ROW_GROUP,
    )
    lake.store.put(part_path(name, part), sink.getvalue().to_pybytes())


def _clean_up(lake: Lake, older_than: float) -> list[Entry]:
    """Delete the files that no row names that counts, or counted within that time."""
    before_ns = time.time_ns() - round(older_than * 1e9)
    # Rows come first: a part that is written meanwhile is younger than `older_than`.
    files = {path: rows.to_pylist() for path, rows in lake.rows_by_file().items()}
    covered = lake.covered()
    latest: dict[str, dict[str, Any]] = {}
    for row in itertools.chain.from_iterable(files.values()):
        if row["run"] not in latest or _order(row) > _order(latest[row["run"]]):
            latest[row["run"]] = row

    def is_over(row: Mapping[str, Any]) -> bool:
        """Tell whether another row took its place so long ago that no reader uses it any more."""
        newest = latest[row["run"]]
        return _order(row) != _order(newest) and newest["committed_ns"] < before_ns

    living = [
        row
        for row in itertools.chain.from_iterable(files.values())
        if not is_over(row) and not (row["is_removed"] and row["committed_ns"] < before_ns)
    ]
    needed = {
        **{answer.table: {row["part"] for row in living} for answer in answers()},
        VIEWS: {row["view_part"] for row in living},
        DATABASE: {row["database_part"] for row in living},
    }
    unneeded = [
        entry
        for folder, parts in needed.items()
        for entry in lake.store.entries(folder)
        if entry.changed_ns < before_ns
        and is_file_of_part(entry.path)
        and _part_of(entry) not in parts
    ]
    entries = {entry.path: entry for entry in lake.store.entries(RUN, recursive=False)}
    # A reader that listed them before their replacement was there may still read them.
    unneeded += [
        entries[path]
        for path, by in covered.items()
        if path in entries and by in entries and entries[by].changed_ns < before_ns
    ]
    rest = dict(files)
    while True:
        # The row of a removal stays as long as another row names the run.
        said = Counter(row["run"] for row in itertools.chain.from_iterable(rest.values()))
        over = [
            path
            for path, rows in rest.items()
            if all(
                is_over(row)
                or (row["is_removed"] and said[row["run"]] == 1 and row["committed_ns"] < before_ns)
                for row in rows
            )
        ]
        if not over:
            break
        unneeded += [entries[path] for path in over if path in entries]
        for path in over:
            del rest[path]
    return [entry for entry in unneeded if _delete(lake, entry)]


def _delete(lake: Lake, entry: Entry) -> bool:
    """Delete a file, unless a writer has written it again meanwhile."""
    now = lake.store.entry(entry.path)
    if now is None or now.changed_ns != entry.changed_ns:
        return False
    lake.store.delete(entry.path)
    return True


def _order(row: Mapping[str, Any]) -> tuple[int, int, str]:
    return row["generation"], row["committed_ns"], row["part"] or ""


def _part_of(entry: Entry) -> str | None:
    for segment in entry.path.split("/"):
        if segment.startswith("part="):
            return segment.removeprefix("part=")
    return None
