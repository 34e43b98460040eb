"""Many recordings, on one machine or many, into one lake of Parquet files."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict

import typer

from msgflow.backports import Unpack
from msgflow.cli.compare import EvenByChance, FailOn, OnlyDifferent, print_comparison
from msgflow.cli.operation import operation
from msgflow.cli.options import Reader, bytes_of, one_text
from msgflow.cli.output import Shown, print_list, print_note, print_result, print_status
from msgflow.cli.sql import DEFAULT_LIMIT, FileOption, sql_of
from msgflow.errors import ExitCode, UsageError
from msgflow.export.formats import Format
from msgflow.result.layout import MOST_ROWS
from msgflow.run.window import duration_ns
from msgflow.text.values import count

if TYPE_CHECKING:
    from msgflow.fleet.ingest import FleetProgress
    from msgflow.fleet.lake import Lake

app = typer.Typer()

_SHARD = re.compile(r"(\d{1,9})/(\d{1,9})", re.ASCII)
_MOST_FAILURES = 20
_MOST_WORST = 1_000


@app.command("ingest")
@operation
def ingest(
    sources: list[str],
    *,
    lake: str,
    label: list[str] | None = None,
    shard: str | None = None,
    ray: str | None = None,
    replace: bool = False,
    retry_failed: bool = False,
    tries: Annotated[int, typer.Option(min=1)] = 3,
    timeout: str = "1h",
    memory: str | None = None,
    scratch: Path | None = None,
    database: Annotated[bool, typer.Option()] = True,
    clock_sync: Annotated[str, typer.Option()] = "none",
    reader: Reader = "auto",
    strict: bool = False,
    ignore: list[str] | None = None,
    events: list[str] | None = None,
    quiet: bool = False,
) -> None:
    """Ingest many recordings into a lake, each as one run.

    What fails is noted in the lake, and the rest goes on. Started again it does what is left.
    Exit code 0: all are in the lake; 1: some are not; 3: none is.

    Args:
        sources (SOURCE...): Recordings: directories, archives, patterns ('s3://bucket/night/*'), or
            manifests (.csv) with a column path and labels.
        label (KEY=VALUE): Say so of all; may be repeated.
        shard (I/N): Do this part of N, 0/N is the first.
        ray (ADDRESS): Ray cluster that does the work: its address, auto, or local; by default
            none.
        replace: Ingest again what the lake has already.
        retry_failed: Try again what failed before.
        tries: How often, where the next one may go better.
        timeout (TIME): What one recording may take: 90s, 2h.
        memory (SIZE): What one recording may take, such as 4GB; else no limit.
        scratch (DIR): Folder of each worker; by default that of the system.
        database: Also write the database of each run.
        clock_sync (none|messages): As msgflow ingest has it, for each.
    """
    if clock_sync not in ("none", "messages"):
        raise UsageError(
            f"a fleet has no offsets in common — {clock_sync}", "--clock-sync messages, or none"
        )
    labels = _labels(label or [])
    seconds = duration_ns(timeout, "--timeout") / 1e9
    most = None if memory is None else bytes_of(memory, "--memory 4GB")
    part = _shard(shard)
    from msgflow.cli.progress import fleet_progress
    from msgflow.fleet.ingest import fleet_ingest
    from msgflow.fleet.task import Options

    given: dict[str, Any] = {
        "reader": reader,
        "strict": strict,
        "ignore": ignore or [],
        "events": events or [],
        "clock_sync": clock_sync,
    }
    options = Options(
        ingest=given,
        database=database,
        replace=replace,
        retry_failed=retry_failed,
        tries=tries,
        timeout=seconds,
        memory=most,
        scratch=None if scratch is None else str(scratch.absolute()),
    )
    with fleet_progress(quiet) as progress:
        report = fleet_ingest(
            sources, lake, ray=ray, options=options, labels=labels, shard=part, progress=progress
        )
    _print_report(report, f"{lake}, shard {shard}" if shard else lake, quiet)
    if report.in_lake < report.total:
        raise typer.Exit(ExitCode.FAILED if report.in_lake else ExitCode.TRACE)


def _print_report(report: FleetProgress, lake: str, quiet: bool) -> None:
    if not quiet:
        kinds = {
            "added": report.added,
            "replaced": report.replaced,
            "there before": report.there,
            "the same as others": report.same,
            "failed": report.failed,
            "failed before": report.failed_before,
        }
        words = ", ".join(f"{number:,} {kind}" for kind, number in kinds.items() if number)
        print_status(
            f"{count(report.total, 'recording')} for {lake}: {words or 'none'}; {report.events:,}"
            f" events in {report.seconds:.1f} s"
        )
        for worker, number in sorted(report.workers.items()):
            print_status(f"  {worker}: {count(number, 'recording')}")
    for source, reason, error in report.failures[:_MOST_FAILURES]:
        print_note(f"{reason}: {error}" if source in error else f"{reason}: {error} — {source}")
    more = len(report.failures) - _MOST_FAILURES
    if more > 0 or report.failed_before:
        print_note(
            f"{max(more, 0) + report.failed_before:,} more did not go in: msgflow fleet failures;"
            " --retry-failed tries again"
        )


@app.command("runs")
@operation
def runs(*, lake: str, **shown: Unpack[Shown]) -> None:
    """List the runs of a lake."""
    from msgflow.fleet.lake import list_runs

    print_result(list_runs(_opened(lake)), **shown)


@app.command("failures")
@operation
def failures(*, lake: str, **shown: Unpack[Shown]) -> None:
    """List the recordings that did not go into a lake, and why."""
    from msgflow.fleet.lake import list_failures

    print_result(list_failures(_opened(lake)), **shown)


class Selected(TypedDict, total=False):
    """What is asked of the rows of a query, as options."""

    node: list[str] | None
    topic: list[str] | None
    callback: list[str] | None
    host: list[str] | None
    via: list[str] | None
    without: list[str] | None
    sort: list[str] | None
    limit: int | None


@app.command("query")
@operation
def query(
    name: str | None = None,
    *,
    lake: str = "",
    where: str | None = None,
    group_by: list[str] | None = None,
    measure: str | None = None,
    section: str | None = None,
    case: str | None = None,
    internal: bool = False,
    columns: str | None = None,
    form: Format | None = None,
    output: Path | None = None,
    wide: bool = False,
    **selected: Unpack[Selected],
) -> None:
    """Ask a named query of many runs, as msgflow query asks it of one.

    Quantiles come from the latencies of all flows, or from counts in buckets that are off by less
    than 1 %; they are never averages of those of runs.

    Args:
        name ([NAME]): Named query; without it they are listed.
        group_by (LABEL): One row for each value of this label (or column of run); several between
            commas.
        measure (WHAT): What topics measures: see msgflow query.
        section (WHAT): What info lists: findings or quality.
        case: With e2e-latency: flows that count: first or last arrival of each root, newest root of
            each arrival, or all.
    """
    from msgflow.fleet.lake_query import fleet_query, header_of, names
    from msgflow.query.selection import values_of

    if name is None:
        listed = [(each.words, each.title) for each in map(header_of, names())]
        print_list(listed, ("query", "title"))
        return
    words = {"case": case, "measure": measure, "section": section}
    own = {word: value for word, value in words.items() if value is not None}
    header_of(name, own)
    given = {word: one_text(value) for word, value in selected.items()}
    groups = values_of(one_text(group_by))
    result = fleet_query(
        _opened(lake), name, where=where, group_by=groups, internal=internal, selection=given, **own
    )
    most = selected.get("limit") or MOST_ROWS
    print_result(result, form, output, wide=wide, columns=columns, most_rows=most)


@app.command("sql")
@operation
def sql(
    text: str | None = None,
    *,
    lake: str = "",
    where: str | None = None,
    file: FileOption = None,
    limit: Annotated[int, typer.Option(min=0)] = DEFAULT_LIMIT,
    **shown: Unpack[Shown],
) -> None:
    """Run SQL on the tables of a lake, read-only and without access to anything else.

    Tables are run, flow, distribution and the others of docs/fleet.md, with the rows of the chosen
    runs that count; public views are view.publication and so on.

    Args:
        text ([SQL]): A query; - reads it from stdin.
        file: Read the query from FILE.
        limit (ROWS): Maximum number of rows to print; 0 for all.
    """
    from msgflow.fleet.lake_query import fleet_sql

    query = sql_of(text, file, "msgflow fleet sql 'FROM run'")
    result = fleet_sql(_opened(lake), query, where=where, limit=limit or None)
    print_result(result, **shown)


@app.command("worst")
@operation
def worst(
    path: Annotated[str, typer.Argument()],
    *,
    lake: str,
    where: str | None = None,
    limit: Annotated[int, typer.Option(min=1, max=_MOST_WORST)] = 10,
    columns: str | None = None,
    **shown: Unpack[Shown],
) -> None:
    """Show the flows of a path that took longest, with what opens each.

    Args:
        path (PATH): Text of a path, a glob, or a part: a topic.
        limit (N): Number of flows.
    """
    from msgflow.fleet.lake_query import fleet_worst

    result = fleet_worst(_opened(lake), path, where=where, limit=limit)
    print_result(result, **shown, columns=columns, most_rows=limit)


@app.command("open")
@operation
def open_(run: Annotated[str, typer.Argument()], *, lake: str, output: Path | None = None) -> None:
    """Bring one run of a lake back as an ordinary database, for flow, ui and all other commands.

    Args:
        run (RUN): Key of a run, the begin of it, or a name.
        output: New database file; one that exists is not replaced. By default RUN.duckdb.
    """
    from msgflow.fleet.run_database import open_run

    done = open_run(_opened(lake), run, output)
    more = f", upgraded from schema revision {done.before}" if done.before else ""
    print_status(f"run {done.name} ({done.run}) is in {done.path}: {done.size:,} bytes{more}")


@app.command("remove")
@operation
def remove(keys: list[str] | None = None, *, lake: str) -> None:
    """Remove runs from a lake, and all files that no run needs.

    Without a run: files of runs that were replaced and of killed writers, after a day.

    Args:
        keys ([RUN...]): Keys of runs.
    """
    opened = _opened(lake)
    runs = list(dict.fromkeys(keys or ()))
    files, size = opened.clean_up(opened.remove(runs) if runs else ())
    print_status(
        f"{count(len(runs), 'run')} and {count(files, 'file')} of {size / 1e6:,.1f} MB removed"
        f" from {lake}"
    )


@app.command("compare")
@operation
def compare(
    base: str | None = None,
    other: str | None = None,
    *,
    lake: str,
    by: str,
    where: str | None = None,
    unit: str | None = None,
    case: str = "first",
    confidence: float = 0.95,
    at_least: str = "5%",
    fail_on: FailOn = None,
    even_by_chance: EvenByChance = False,
    only_different: OnlyDifferent = None,
    **shown: Unpack[Shown],
) -> None:
    """Compare paths in runs of one version (robot, site) with those of another.

    The run is the unit: how much runs of one side differ from each other tells whether the two
    sides differ.

    Args:
        base (BASE): Its value on side A, which the other is compared with; by default the lesser,
            where there are two.
        other (OTHER): Its value on side B.
        by (LABEL): Label that tells the two sides apart.
        unit (LABEL): All runs with one value of this label count as one, such as those of a robot;
            by default each run for itself.
        case: Flows that count: first or last arrival of each root, newest root of each arrival, or
            all.
        confidence: Confidence level of the intervals.
        at_least (CHANGE): Smallest change that matters: less is about equal.
    """
    from msgflow.fleet.compare import compare as compared

    comparison = compared(
        _opened(lake),
        by,
        base,
        other,
        where=where,
        unit=unit,
        case=case,
        confidence=confidence,
        at_least=at_least,
    )
    print_comparison(comparison, fail_on or [], even_by_chance, only_different, **shown)


def _labels(texts: list[str]) -> dict[str, str]:
    from msgflow.db.runs import require_label

    labels: dict[str, str] = {}
    for text in texts:
        key, sign, value = text.partition("=")
        if not (sign and value):
            raise UsageError(f"a label is KEY=VALUE — {text}", "--label site=berlin")
        if labels.setdefault(key, value) != value:
            raise UsageError(f"a recording has one label of a key — {key}", "give it once")
        require_label(key, value)
    return labels


def _shard(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    match = _SHARD.fullmatch(text)
    if match is None or int(match[1]) >= int(match[2]):
        raise UsageError(f"--shard takes I/N — {text}", "the shards of 3 are 0/3, 1/3 and 2/3")
    return int(match[1]), int(match[2])


def _opened(lake: str) -> Lake:
    # Some commands do something without a lake, too.
    if not lake:
        raise UsageError("no lake is named", "--lake PATH, or MSGFLOW_LAKE")
    from msgflow.fleet.lake import Lake

    return Lake.open(lake)
