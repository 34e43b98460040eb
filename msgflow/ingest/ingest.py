"""One ingest: all given traces become one run of a database, or nothing changes."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import duckdb

from msgflow import trace as trace_package
from msgflow.clocks.clocks_file import read_clock_sync
from msgflow.clocks.correction import set_clocks
from msgflow.db import migration
from msgflow.db.connection import attach
from msgflow.db.derivation import derive
from msgflow.db.finding import Finding, read_findings
from msgflow.db.memory import default_limit, ingest_memory_errors, limit_threads, set_memory_limit
from msgflow.db.sandbox import open_memory, shut_in
from msgflow.db.transaction import transaction
from msgflow.db.workspace import creating, workspace
from msgflow.errors import DatabaseError, UsageError
from msgflow.ingest import model, refusals, staging
from msgflow.ingest.hostnames import hostnames_of
from msgflow.ingest.load import load_traces
from msgflow.ingest.samples import load_samples
from msgflow.ingest.stored_run import fallback_name, require_free_name, store_run
from msgflow.ingest.system_samples import load_system_samples
from msgflow.links.annotations import declare_links
from msgflow.links.links_file import LinksFile, read_links
from msgflow.run.choice import require_run_name
from msgflow.sql.failure import database_errors, in_words
from msgflow.sql.interrupt import Interrupts, interruptible, noted_interrupts
from msgflow.trace import Progress, TraceSet


@dataclass(frozen=True)
class IngestProgress:
    """How far an ingest has come.

    Attributes:
        stage: the work that is going on, for people.
        events: events read so far.
        fraction: part of this stage that is done, 0 to 1; None if it is not known.
        events_per_second: rate of reading so far.
    """

    stage: str
    events: int
    fraction: float | None
    events_per_second: float


@dataclass(frozen=True)
class IngestReport:
    """What an ingest did.

    Attributes:
        run_id: the new run.
        run_name: its name.
        findings: what is worth knowing about the input and the recording.
        event_count: events read.
        stage_seconds: wall time by stage [s], in the order of the stages.
        warnings: what went wrong though the run was stored, for people.
    """

    run_id: int
    run_name: str
    findings: tuple[Finding, ...]
    event_count: int
    stage_seconds: Mapping[str, float]
    warnings: tuple[str, ...] = ()

    @property
    def seconds(self) -> float:
        """Wall time of the whole ingest."""
        return sum(self.stage_seconds.values())


def ingest(
    paths: Sequence[str | Path],
    database: Path,
    *,
    name: str | None = None,
    replace: bool = False,
    hosts: Mapping[str, str | Path | Sequence[str | Path]] | None = None,
    keep_staging: Path | None = None,
    links: Path | LinksFile | None = None,
    clock_sync: str | Path = "none",
    reader: str = "auto",
    strict: bool = False,
    ignore: Sequence[str] = (),
    events: Sequence[str] = (),
    memory_limit: str | None = None,
    progress: Callable[[IngestProgress], None] | None = None,
    traces: TraceSet | None = None,
) -> IngestReport:
    """Read all traces below `paths` into `database` as one run; see `Database.ingest`.

    Everything happens in one transaction; a new database appears only when it is complete. Ctrl-C
    ends the ingest until the run is stored, and is ignored while it is being finished after that.

    `traces` are what to read, if they were opened before; `paths` only give the run its name then.
    """
    if "" in paths:
        raise UsageError(
            "the path of a trace is empty", "msgflow ingest TRACE, or . for the current directory"
        )
    if name is not None:
        require_run_name(name)
    declared = read_links(links) if isinstance(links, Path) else links
    clocks = read_clock_sync(clock_sync)
    if database.is_symlink():
        database = Path(os.path.realpath(database))
    with (
        noted_interrupts() as interrupts,
        database_errors(database),
        ingest_memory_errors(memory_limit),
    ):
        watch = _Watch(progress, interrupts)
        watch.enter("opening the traces")
        # Traces that were opened before are a part of a recording that still grows.
        beside = paths if traces is None else ()
        with traces or trace_package.open(paths, reader=reader, strict=strict) as traces:
            refusals.require_ros_traces(traces.traces)
            hostnames = hostnames_of(traces.traces, hosts or {})
            migration.require_ingestable(database)
            with (
                contextlib.nullcontext() if database.exists() else creating(database),
                workspace(database) as directory,
                _target(database, directory) as target,
                contextlib.closing(open_memory()) as con,
            ):
                is_new = target != database
                set_memory_limit(con, memory_limit or default_limit(con))
                limit_threads(con)
                con.execute("SET temp_directory = ?", [str(directory)])
                # A checkpoint would write many of the row groups that were just written again.
                con.execute("SET max_vacuum_tasks = 0")
                if not is_new:
                    attach(con, target)
                    if name is not None and not replace:
                        require_free_name(con, name)
                staging.attach(con, directory)
                written = [directory, *([keep_staging] if keep_staging else [])]
                shut_in(con, directories=written, lock=False)
                watch.enter("reading the traces")
                with staging.writing(con):
                    replaced = load_traces(
                        con,
                        traces,
                        hostnames=hostnames,
                        ignore=ignore,
                        events=events,
                        may_hold=not is_new,
                        replace=replace,
                        interrupts=interrupts,
                        progress=watch.reading,
                    )
                    unread = load_samples(
                        con,
                        beside,
                        traces,
                        hostnames=hostnames,
                        workspace=directory,
                        interrupts=interrupts,
                    )
                    load_system_samples(
                        con, beside, traces, hostnames=hostnames, interrupts=interrupts
                    )
                refusals.require_ros_events(traces.traces, traces.event_counts, traces.damages)
                event_count = sum(traces.event_counts.values())

                def write() -> tuple[int, str, tuple[Finding, ...]]:
                    watch.enter("building the model")
                    with staging.writing(con):
                        # To drop small tables would free next to nothing.
                        is_small = event_count < staging.ROWS_PER_INSERT
                        model.build(con, keep=is_small or keep_staging is not None)
                    if is_new:
                        migration.create(target)
                        attach(con, target, is_new=True)
                    if keep_staging is not None:
                        watch.enter("writing the staged events")
                        staging.export(con, keep_staging)
                    with transaction(con):
                        watch.enter("storing the run")
                        run_id, run_name = store_run(con, name, fallback_name(paths), replaced)
                        watch.enter("linking messages")
                        if declared is not None:
                            declare_links(con, run_id, declared)
                        derive(con, run_id, synchronise=lambda: set_clocks(con, run_id, clocks))
                        findings = tuple(read_findings(con, [run_id], info=True))
                        interrupts.make_final()
                    return run_id, run_name, findings

                run = interruptible(con, write)
                watch.enter("closing the database")
                staging.leave(con)
                warnings = (*unread, *_finished(con, database, is_new=is_new))
        return IngestReport(*run, event_count, watch.finish(), warnings)


def _finished(con: duckdb.DuckDBPyConnection, database: Path, *, is_new: bool) -> tuple[str, ...]:
    """Put all that was committed into the file, and return what went wrong there."""
    try:
        con.execute("CHECKPOINT")
    except duckdb.Error as error:
        words = in_words(error, database)
        if is_new or words is None:
            raise
        # The run is in the log, which the next one to open the database reads.
        log = database.with_name(f"{database.name}.wal").name
        return (
            f"the run is stored, but in {log} as yet, which has to stay beside the database until"
            f" a later command has moved it into the file: {words.message}",
        )
    return ()


@contextlib.contextmanager
def _target(database: Path, directory: Path) -> Iterator[Path]:
    """Yield the file to write to: the database, or a new one that takes its place at the end."""
    if database.exists():
        yield database
        return
    fresh = directory / "target.duckdb"
    yield fresh
    try:
        os.link(fresh, database)
    except FileExistsError:
        raise DatabaseError(
            f"another process created the database meanwhile — {database}", "ingest again"
        ) from None
    except OSError:
        os.replace(fresh, database)  # a file system without hard links


class _Watch:
    """Times the stages and reports them, and ends the ingest between two of them on Ctrl-C."""

    def __init__(
        self, report: Callable[[IngestProgress], None] | None, interrupts: Interrupts
    ) -> None:
        self._report = report
        self._interrupts = interrupts
        self._begins: dict[str, float] = {}  # of the stages, in their order
        self._events = 0
        self._rate = 0.0

    def enter(self, stage: str) -> None:
        """Begin a stage, unless Ctrl-C came during the one before."""
        self._interrupts.check()
        self._begins[stage] = time.monotonic()
        self._tell(None)

    def reading(self, state: Progress, seconds: float) -> None:
        self._events = state.events
        self._rate = state.events / seconds if seconds > 0 else 0.0
        self._tell(state.fraction)

    def finish(self) -> Mapping[str, float]:
        """Return how long each stage took."""
        stages, begins = list(self._begins), list(self._begins.values())
        ends = [*begins[1:], time.monotonic()]
        return {stage: end - begin for stage, begin, end in zip(stages, begins, ends, strict=True)}

    def _tell(self, fraction: float | None) -> None:
        if self._report is not None:
            stage = next(reversed(self._begins))
            self._report(IngestProgress(stage, self._events, fraction, self._rate))
