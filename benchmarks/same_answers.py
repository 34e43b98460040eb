"""Whether two checkouts give the same answers: every public view and query, row for row.

    python benchmarks/same_answers.py BEFORE [AFTER] [--system 'NAME [OPTION…]']…
        [--recording NAME]… [--factor 0.1] [--traces DIR] [--jobs N]

Each checkout ingests the same traces into a new database: those that `msgflow simulate NAME` of
BEFORE writes, with the options given there, and the recorded ones in ../shared/traces where that
folder exists. Then both give every public view, every table macro of whole runs or of a few
messages, every named query, the findings and the broken rules. AFTER is this checkout when left
out.

Prints a line for each difference: what it is of, and rows that only one of them has. Rows of views
are compared in any order, those of queries in theirs. What the versions say of themselves does not
count. The exit code is 1 if anything differs. Without `--system` and `--recording` the systems are
those of DAILY, and all recordings; `--system all` is every one there is.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any

import duckdb

HERE = Path(__file__).resolve().parents[1]
SHARED_TRACES = HERE.parent / "shared" / "traces"
# Several hosts with clocks apart, losses, services, executors, annotations, objects never declared.
DAILY = (
    "autoware",
    "bursts_two_hosts --clock-offset 0.02 --clock-drift 30",
    "pipeline --lose-events 0.05",
    "reentrant",
    "services",
    "rtabmap --start-late 0.5",
)
# What a checkout says of itself.
OWN = {"created_at", "derivation_hash", "msgflow_version"}
# What table macros are called with, one call for each value where there are several.
ARGUMENTS = {
    "runs": ["[1]"],
    "only_run": ["1"],
    "run_a": ["1"],
    "run_b": ["1"],
    "what": ["'paths'", "'callbacks'", "'topics'"],
    "start_kind": ["'publication'"],
    "start_id": [
        f"(SELECT quantile_disc(publication_id, {share}) FROM main.publication)"
        for share in (0, 0.3, 0.6)
    ],
    # Names of tables.
    "outcomes": ["'same_outcomes'"],
    "flows": ["'same_flows'"],
    "trail": ["'same_trail'"],
    "callbacks": ["'same_callbacks'"],
    "parts": ["'same_parts'"],
    "vertices": ["'same_vertices'"],
    "intervals": ["'same_intervals'"],
    "waited": ["'same_waits'"],
    "of_samples": ["'same_samples'"],
    # Of executor_activity_within: everything, and a window.
    "window_start_ns": ["NULL", "(SELECT quantile_disc(start_ns, 0.3) FROM main.publication)"],
    "window_end_ns": ["NULL", "(SELECT quantile_disc(start_ns, 0.6) FROM main.publication)"],
}
TABLES = {
    "same_outcomes": "main.end_to_end([1])",
    "same_flows": "main.end_to_end_flow([1])",
    "same_trail": "main.end_to_end_trail('same_flows', [1])",
    "same_callbacks": "(SELECT i.*, w.busy_min_ns, w.busy_max_ns FROM main.callback_instance AS i"
    " LEFT JOIN main.executor_wait AS w USING (callback_instance_id))",
    "same_parts": "main.end_to_end_part([1], flow_case := 'every_pair', most_flows := 3)",
    "same_intervals": "(SELECT callback_instance_id AS interval_id, thread_id, start_ns AS from_ns,"
    " end_ns AS to_ns FROM main.callback_instance WHERE end_ns IS NOT NULL)",
    "same_waits": "main.executor_wait_explained([1])",
    "same_samples": "(SELECT run_id AS group_id, stack_id, cpu_ns FROM main.stack_sample)",
    "same_vertices": "(SELECT 0 AS key, 'take' AS kind, take_id AS id, 0 AS depth FROM main.take)",
}
ROWS_SHOWN = 3


def main() -> None:
    """Ingest, read, compare, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path, nargs="?", default=HERE)
    parser.add_argument("--system", action="append", default=[])
    parser.add_argument("--recording", action="append", default=[])
    parser.add_argument("--factor", type=float, default=0.1)
    parser.add_argument("--traces", type=Path, default=SHARED_TRACES)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    for checkout in (asked.before, asked.after):
        require_checkout(checkout)
    systems, recordings = chosen(asked)
    with tempfile.TemporaryDirectory(prefix="msgflow-same-") as directory:

        def compared(name: str) -> tuple[str, list[str]]:
            trial = Path(tempfile.mkdtemp(dir=directory))
            trace = asked.traces / name
            if name in systems:
                trace = trial / "trace"
                simulated(asked.before, name, asked.factor, trace)
            folders = [trial / "before", trial / "after"]
            for checkout, folder in zip((asked.before, asked.after), folders, strict=True):
                answer(checkout, trace, folder)
            return name, list(differences(*folders))

        count = 0
        with ThreadPoolExecutor(asked.jobs) as pool:
            for name, found in pool.map(compared, [*systems, *recordings]):
                count += len(found)
                print(f"{name}: {f'{len(found)} differ' if found else 'the same'}", flush=True)
                for line in found:
                    print(f"    {line}", flush=True)
    sys.exit(1 if count else 0)


def chosen(asked: argparse.Namespace) -> tuple[list[str], list[str]]:
    """Return which systems and which recordings to compare."""
    systems, recordings = list(asked.system), list(asked.recording)
    if systems == ["all"]:
        listed = run(asked.before, ["-m", "msgflow", "simulate", "--list"])
        systems = [line.split()[0] for line in listed.splitlines() if line[:1].strip()]
    if not systems and not recordings:
        systems = list(DAILY)
        if asked.traces.is_dir():
            recordings = sorted(path.name for path in asked.traces.iterdir() if path.is_dir())
    return systems, recordings


def run(checkout: Path, arguments: Sequence[str]) -> str:
    """Return what Python prints in a checkout.

    Raises:
        SystemExit: it failed.
    """
    environment = {**os.environ, "PYTHONPATH": str(checkout.resolve())}
    # -P: the folder in which this is run may be a checkout, too, and would come first.
    done = subprocess.run(
        [sys.executable, "-P", *arguments],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    if done.returncode:
        sys.exit(f"{checkout}: {shlex.join(arguments)}\n{done.stderr}")
    return done.stdout


def require_checkout(checkout: Path) -> None:
    """Refuse a folder from which Python would not run its own msgflow.

    Raises:
        SystemExit: it would not.
    """
    package = checkout.resolve() / "msgflow" / "__init__.py"
    if not package.is_file():
        sys.exit(f"not a checkout of msgflow — {checkout}")
    found = run(checkout, ["-c", "import msgflow; print(msgflow.__file__)"]).strip()
    if Path(found).resolve() != package:
        sys.exit(f"{checkout} would run {found}")


def simulated(checkout: Path, system: str, factor: float, target: Path) -> None:
    """Write the trace of a system, given as its name and options."""
    name, *options = shlex.split(system)
    length = [] if "--factor" in options else ["--factor", str(factor)]
    run(checkout, ["-m", "msgflow", "simulate", name, "-o", str(target), *length, *options])


def answer(checkout: Path, trace: Path, folder: Path) -> None:
    """Write what a checkout makes of a trace: one Parquet file per view, macro and query."""
    folder.mkdir()
    database = folder / "run.duckdb"
    run(checkout, ["-m", "msgflow", "ingest", str(trace), "--db", str(database)])
    run(checkout, ["-c", READER, str(Path(__file__).parent), str(database), str(folder)])


READER = "import sys; sys.path.append(sys.argv[1]); import same_answers; same_answers.read_all()"


def read_all() -> None:
    """Read the database of the command line into files; runs in a checkout."""
    import pyarrow.parquet

    import msgflow

    database, folder = Path(sys.argv[2]), Path(sys.argv[3])
    with duckdb.connect(str(database), read_only=True) as connection:
        for table, rows in TABLES.items():
            # An older checkout has none of these.
            with contextlib.suppress(duckdb.CatalogException):
                connection.execute(f"CREATE TEMP TABLE {table} AS FROM {rows}")
        for name, source in sources(connection):
            connection.execute(
                f"COPY (SELECT * FROM {source} ORDER BY ALL) TO '{folder}/{name}.parquet'"
            )
    with msgflow.open_db(database) as opened:
        for header in opened.list_queries():
            result = opened.query(header.name, run=1, internal=True)
            result.to_parquet(folder / f"query {header.name}.parquet")
        told: dict[str, Sequence[Any]] = {
            "findings": opened.findings(run=1),
            "broken rules": opened.check(),
        }
    for name, items in told.items():
        rows = pyarrow.array([json.dumps(asdict(item)) for item in items], pyarrow.string())
        pyarrow.parquet.write_table(pyarrow.table({"told": rows}), folder / f"query {name}.parquet")


def sources(connection: duckdb.DuckDBPyConnection) -> Iterator[tuple[str, str]]:
    """Yield (name, what to select from) of all public views, and calls of public table macros."""
    views = connection.execute(
        "SELECT view_name FROM duckdb_views() WHERE schema_name = 'main' AND NOT internal"
    ).fetchall()
    for (name,) in views:
        yield f"view {name}", f"main.{name}"
    for name, parameters in macros(connection):
        given = [parameter for parameter in parameters if parameter in ARGUMENTS]
        for number, values in enumerate(product(*(ARGUMENTS[parameter] for parameter in given))):
            arguments = ", ".join(map("{} := {}".format, given, values))
            yield f"macro {name} {number}", f"main.{name}({arguments})"


def macros(connection: duckdb.DuckDBPyConnection) -> list[tuple[str, list[str]]]:
    """Return (name, parameters) of all public table macros, the shortest form of each."""
    return connection.execute(
        "SELECT function_name, arg_min(parameters, len(parameters)) FROM duckdb_functions() "
        "WHERE schema_name = 'main' AND NOT internal AND function_type = 'table_macro' "
        # They read rows that only a query makes.
        "AND function_name NOT IN ('end_to_end_between', 'looped_arrival') "
        "GROUP BY function_name ORDER BY function_name"
    ).fetchall()


def differences(before: Path, after: Path) -> Iterator[str]:
    """Yield how the answers of two folders differ."""
    names = {folder: {path.stem for path in folder.glob("*.parquet")} for folder in (before, after)}
    if not names[before] or not names[after]:
        yield "nothing was read"
    for name in sorted(names[before] ^ names[after]):
        yield f"{name}: only {'before' if name in names[before] else 'after'}"
    for name in sorted(names[before] & names[after]):
        yield from difference(name, before / f"{name}.parquet", after / f"{name}.parquet")


def difference(name: str, before: Path, after: Path) -> Iterator[str]:
    """Yield how two files differ: in columns, else in rows."""
    with duckdb.connect() as connection:
        for side, path in (("before", before), ("after", after)):
            is_ordered = str(name.startswith("query ")).lower()
            connection.execute(
                f"CREATE VIEW {side} AS FROM read_parquet('{path}', file_row_number = {is_ordered})"
            )
        columns = {
            side: connection.execute(
                f"SELECT column_name, column_type FROM (DESCRIBE {side})"
            ).fetchall()
            for side in ("before", "after")
        }
        if columns["before"] != columns["after"]:
            changed = set(columns["before"]) ^ set(columns["after"]) or "their order"
            yield f"{name}: columns: {changed}"
            return
        shared = ", ".join(f'"{column}"' for column, _ in columns["before"] if column not in OWN)
        for one, other in (("before", "after"), ("after", "before")):
            lacking = connection.execute(
                f"SELECT {shared} FROM {one} EXCEPT ALL SELECT {shared} FROM {other} ORDER BY ALL"
            ).fetchall()
            if lacking:
                yield f"{name}: {len(lacking)} rows only {one}, such as {lacking[:ROWS_SHOWN]}"


if __name__ == "__main__":
    main()
