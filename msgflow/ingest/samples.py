"""Loads samples of stacks, which perf took beside a recording, into `raw`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pyarrow as pa

from msgflow.db.transaction import transaction
from msgflow.errors import TraceError
from msgflow.trace.perf_script import DATA, TEXT, read_script, sample_files, write_script

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import duckdb

    from msgflow.sql.interrupt import Interrupts


def load_samples(
    con: duckdb.DuckDBPyConnection,
    paths: Sequence[str | Path],
    *,
    workspace: Path,
    interrupts: Interrupts,
) -> tuple[str, ...]:
    """Load the samples below these paths, and return what could not be read, for people.

    `workspace` is a folder for the text of perf.
    """
    warnings = []
    for file in sample_files(paths):
        text = file
        try:
            if file.name == DATA:
                text = workspace / TEXT
                write_script(file, text)
            with transaction(con):
                for part in read_script(text):
                    interrupts.check()
                    count = len(part.heads)
                    rows = pa.table(
                        {
                            "hostname": pa.array([part.hostname] * count, pa.string()),
                            "is_monotonic": [part.is_monotonic] * count,
                            "head": part.heads,
                            "stack": part.stacks,
                        }
                    )
                    con.from_arrow(rows).insert_into("raw.main.stack_sample")
        except TraceError as error:
            warnings.append(f"{error.message}{f'; {error.hint}' if error.hint else ''}")
    return tuple(warnings)
