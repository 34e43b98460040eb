"""Loads samples of stacks, which perf took beside a recording, into `raw`."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import duckdb
import pyarrow as pa

from msgflow.db.transaction import transaction
from msgflow.errors import TraceError
from msgflow.sql.interrupt import Interrupts
from msgflow.trace import TraceSet
from msgflow.trace.perf_script import DATA, TEXT, read_script, sample_files, write_script


def load_samples(
    con: duckdb.DuckDBPyConnection,
    paths: Sequence[str | Path],
    traces: TraceSet,
    *,
    hostnames: Mapping[int, str],
    workspace: Path,
    interrupts: Interrupts,
) -> tuple[str, ...]:
    """Load the samples below these paths, and return what could not be read, for people.

    Those of archives are where the traces have them unpacked. The text of perf goes to `workspace`.
    """
    warnings = []
    for file in sample_files([*paths, *traces.unpacked.archives]):
        shown = Path(os.path.realpath(traces.unpacked.shown(file)))
        hostname = given_name(shown, traces, hostnames)
        text = file
        try:
            if file.name == DATA:
                text = workspace / TEXT
                if (cut := write_script(file, text)) is not None:
                    warnings.append(cut.replace(str(file), str(shown)))
            with transaction(con):
                for part in read_script(text):
                    interrupts.check()
                    count = len(part.heads)
                    rows = pa.table(
                        {
                            "hostname": pa.array([hostname or part.hostname] * count, pa.string()),
                            "is_monotonic": [part.is_monotonic] * count,
                            "head": part.heads,
                            "stack": part.stacks,
                        }
                    )
                    con.from_arrow(rows).insert_into("raw.main.stack_sample")
        except TraceError as error:
            message = error.message.replace(str(file), str(shown))
            warnings.append(f"{message}{f'; {error.hint}' if error.hint else ''}")
    return tuple(warnings)


def given_name(file: Path, traces: TraceSet, hostnames: Mapping[int, str]) -> str | None:
    """Return the name that was given to the host of the traces beside a file, if it is one."""
    for folder in file.parents:
        beside = [trace.index for trace in traces.traces if trace.path.is_relative_to(folder)]
        if beside:
            names = {hostnames.get(index) for index in beside}
            return names.pop() if len(names) == 1 else None
    return None
