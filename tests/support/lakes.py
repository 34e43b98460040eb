"""Lakes for tests: read by the SQL of docs/fleet.md, as without msgflow; and copies of runs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from msgflow.fleet.layout import new_part, part_path
from msgflow.fleet.part import ANSWERS

if TYPE_CHECKING:
    from msgflow.fleet.lake import Lake

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "fleet.md").read_text(encoding="utf-8")
_CREATE_RUN, EXAMPLE = (
    text
    for block in re.findall(r"```sql\n(.*?)```", PAGE, re.DOTALL)
    for text in block.split("\n\n")
)
_ROWS = (
    "SELECT t.* EXCLUDE part FROM read_parquet('LAKE/{table}/*.parquet') AS t "
    "JOIN run USING (run, part) ORDER BY ALL"
)


def read(lake: Lake, sql: str) -> list[tuple[Any, ...]]:
    """Return what SQL returns, with the table `run` of the docs."""
    return _answers(lake, sql)[0]


def rows_of(lake: Lake, table: str) -> list[tuple[Any, ...]]:
    """Return the rows of an answer that count."""
    return read(lake, _ROWS.format(table=table))


def content(lake: Lake) -> list[list[tuple[Any, ...]]]:
    """Return all runs and their answers."""
    runs = "SELECT * EXCLUDE (part, committed_ns) FROM run ORDER BY run"
    return _answers(lake, runs, *(_ROWS.format(table=name) for name in ANSWERS))


def _answers(lake: Lake, *statements: str) -> list[list[tuple[Any, ...]]]:
    with duckdb.connect() as con:
        con.execute(_CREATE_RUN.replace("LAKE", lake.store.url))
        return [con.execute(sql.replace("LAKE", lake.store.url)).fetchall() for sql in statements]


def paths(lake: Lake, *folders: str) -> set[str]:
    """Return the files below some folders."""
    return {entry.path for folder in folders for entry in lake.store.entries(folder)}


def copied(lake: Lake, row: dict[str, Any], key: str, slower: int = 1) -> dict[str, Any]:
    """Write the answers of a run again, as those of another key; commit nothing.

    Returns:
        What `run` is to have: no database.
    """
    copy = {**row, "run": key, "part": new_part(key), "database_part": None}
    for answer in ANSWERS:
        table = pq.ParquetFile(lake.store.full(part_path(answer, row["part"]))).read()
        for name in ("run", "part"):
            table = _with(table, name, pa.array([copy[name]] * len(table), pa.string()))
        if answer == "flow":
            table = _with(table, "latency_ns", pc.multiply(table["latency_ns"], slower))
        lake.put_table(part_path(answer, copy["part"]), answer, table, row["schema_revision"])
    return copy


def _with(table: pa.Table, name: str, values: Any) -> pa.Table:
    return table.set_column(table.column_names.index(name), name, values)
