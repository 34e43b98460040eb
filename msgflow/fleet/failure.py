"""Failed recordings: the table `fleet_failure` of a lake."""

from __future__ import annotations

import hashlib
import time
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.errors import DatabaseError
from msgflow.fleet.layout import FAILURE, FAILURE_SCHEMA
from msgflow.fleet.parquet import read_parquet
from msgflow.version import __version__

if TYPE_CHECKING:
    from collections.abc import Mapping

    from msgflow.fleet.lake import Lake


def read_failures(lake: Lake) -> pa.Table:
    """Return the failed recordings: one row each, columns of `FAILURE_SCHEMA`."""
    tables = [FAILURE_SCHEMA.empty_table()]
    for entry in lake.store.entries(FAILURE, recursive=False):
        # Another process may have ingested the recording and deleted this file meanwhile.
        if entry.path.endswith(".parquet") and (content := lake.store.read(entry.path)):
            try:
                tables.append(read_parquet(content, FAILURE_SCHEMA))
            except (pa.ArrowException, OSError) as error:
                raise DatabaseError(
                    f"cannot read a failure of the lake — {lake.store.url_of(entry.path)}",
                    "delete this file; its recording will be tried again",
                ) from error
    return pa.concat_tables(tables).sort_by("source")


def write_failure(lake: Lake, values: Mapping[str, Any]) -> None:
    """Write the failure of a recording, in place of an earlier one."""
    row = {**values, "msgflow_version": __version__, "failed_ns": time.time_ns()}
    table = pa.Table.from_pylist([row], schema=FAILURE_SCHEMA)
    lake.put_table(_path(row["source"]), FAILURE, table, "")


def forget_failure(lake: Lake, source: str) -> None:
    """Delete the failure of a recording, which is in the lake now."""
    lake.store.delete(_path(source))


def _path(source: str) -> str:
    return f"{FAILURE}/{hashlib.sha256(source.encode(errors='replace')).hexdigest()[:24]}.parquet"
