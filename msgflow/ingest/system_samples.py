"""Loads samples of the system, which `msgflow record` wrote beside a recording, into `raw`."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import duckdb
import pyarrow as pa

from msgflow.ingest.samples import given_name
from msgflow.sql.interrupt import Interrupts
from msgflow.trace import TraceSet
from msgflow.trace.system_samples import read_system_samples, system_sample_files


def load_system_samples(
    con: duckdb.DuckDBPyConnection,
    paths: Sequence[str | Path],
    traces: TraceSet,
    *,
    hostnames: Mapping[int, str],
    interrupts: Interrupts,
) -> None:
    """Load the samples below these paths, and what could not be read of them.

    Those of archives are where the traces have them unpacked.
    """
    files = system_sample_files([*paths, *traces.unpacked.archives])
    for place, file in enumerate(files):
        shown = Path(os.path.realpath(traces.unpacked.shown(file)))
        hostname = given_name(shown, traces, hostnames)
        damages: list[str] = []
        count = 0
        for lines in read_system_samples(file, damages):
            interrupts.check()
            # The first line has the name of the machine.
            if not count:
                hostname = hostname or lines[0].split("\t")[1]
            numbers = range(count, count + len(lines))
            rows = {
                "file": pa.array([place] * len(lines), pa.int32()),
                "hostname": [hostname] * len(lines),
                "number": pa.array(numbers, pa.int64()),
                "line": lines,
            }
            con.from_arrow(pa.table(rows)).insert_into("raw.main.usage")
            count = numbers.stop
        for damage in damages:
            con.execute("INSERT INTO staging.usage_damage VALUES (?, ?)", [str(shown), damage])
