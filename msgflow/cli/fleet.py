"""`msgflow fleet`: many recordings in one lake."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msgflow.cli import fleet_queries
from msgflow.cli.compare import fail_on_option, only_different_option, print_comparison
from msgflow.cli.options import (
    FormatOption,
    LakeOption,
    OutputOption,
    OwnEventsOption,
    Reader,
    ReaderOption,
    WideOption,
    bytes_of,
    case_option,
)
from msgflow.errors import ExitCode, UsageError

if TYPE_CHECKING:
    from msgflow.fleet.ingest import FleetProgress

app = typer.Typer()

_TIME = re.compile(r"(\d+(?:\.\d+)?) ?(s|min|h|d)?")
_SECONDS = {None: 1.0, "s": 1.0, "min": 60.0, "h": 3_600.0, "d": 86_400.0}
_MOST_FAILURES = 20


@app.command("ingest")
def ingest(
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="SOURCE...",
            help="Recordings: directories, archives, patterns ('s3://bucket/night/*'), or manifests"
            " (.csv, .jsonl, .parquet) with a column path and labels",
        ),
    ],
    lake: LakeOption,
    label: Annotated[
        list[str] | None,
        typer.Option("--label", metavar="KEY=VALUE", help="Say so of all; may be repeated"),
    ] = None,
    ray: Annotated[
        str | None,
        typer.Option(
            "--ray",
            metavar="ADDRESS",
            help="Ray cluster that does the work: its address, auto, or local",
            show_default="this process",
        ),
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Ingest again what the lake has already")
    ] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Try again what failed before")
    ] = False,
    tries: Annotated[
        int,
        typer.Option("--tries", min=1, help="How often, where the next one may go better"),
    ] = 3,
    timeout: Annotated[
        str, typer.Option("--timeout", metavar="TIME", help="What one recording may take: 90s, 2h")
    ] = "1h",
    memory: Annotated[
        str | None,
        typer.Option(
            "--memory",
            metavar="SIZE",
            help="What one recording may take, such as 4GB",
            show_default="no limit",
        ),
    ] = None,
    scratch: Annotated[
        str | None,
        typer.Option(
            "--scratch",
            metavar="DIR",
            parser=os.path.expanduser,
            help="Folder of each worker",
            show_default="that of the system",
        ),
    ] = None,
    views: Annotated[
        bool, typer.Option("--views/--no-views", help="Also write the public views")
    ] = True,
    database: Annotated[
        bool, typer.Option("--database/--no-database", help="Also write the database of each run")
    ] = True,
    clock_sync: Annotated[
        str,
        typer.Option(
            "--clock-sync", metavar="none|messages", help="As msgflow ingest has it, for each"
        ),
    ] = "none",
    reader: ReaderOption = Reader.AUTO,
    strict: Annotated[bool, typer.Option("--strict", help="Refuse damaged traces")] = False,
    ignore: Annotated[
        list[str] | None,
        typer.Option("--ignore", metavar="PATTERN", help="Skip events with these names"),
    ] = None,
    events: OwnEventsOption = None,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Print only errors and failures")
    ] = False,
) -> None:
    """Ingest many recordings into a lake, each as one run.

    What fails is noted in the lake, and the rest goes on. Started again it does what is left.
    Exit code 0: all are in the lake; 1: some are not; 3: none is.
    """
    if clock_sync not in ("none", "messages"):
        raise UsageError(
            f"a fleet has no offsets in common — {clock_sync}", "--clock-sync messages, or none"
        )
    labels = _labels(label or [])
    seconds, most = _time(timeout, "--timeout"), _size(memory)
    from msgflow.cli.progress import fleet_progress
    from msgflow.fleet.ingest import Options, fleet_ingest

    given: dict[str, Any] = {
        "reader": reader.value,
        "strict": strict,
        "ignore": ignore or [],
        "events": events or [],
        "clock_sync": clock_sync,
    }
    options = Options(
        ingest=given,
        views=views,
        database=database,
        replace=replace,
        retry_failed=retry_failed,
        tries=tries,
        timeout=seconds,
        memory=most,
        scratch=scratch,
    )
    with fleet_progress(quiet) as progress:
        report = fleet_ingest(
            sources, lake, ray=ray, options=options, labels=labels, progress=progress
        )
    _print_report(report, lake, quiet)
    if report.in_lake < report.total:
        raise typer.Exit(ExitCode.FAILED if report.in_lake else ExitCode.TRACE)


def _print_report(report: FleetProgress, lake: str, quiet: bool) -> None:
    from msgflow.cli.output import print_note, print_status
    from msgflow.text.values import count

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
            f"{count(report.total, 'recording')} for {lake}: {words}; {report.events:,} events in"
            f" {report.seconds:.1f} s"
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
def runs(
    lake: LakeOption,
    form: FormatOption = None,
    output: OutputOption = None,
    wide: WideOption = False,
) -> None:
    """List the runs of a lake."""
    from msgflow.cli.output import print_result
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.listing import list_runs

    print_result(list_runs(Lake.open(lake)), form, output, wide=wide)


@app.command("failures")
def failures(
    lake: LakeOption,
    form: FormatOption = None,
    output: OutputOption = None,
    wide: WideOption = False,
) -> None:
    """List the recordings that did not go into a lake, and why."""
    from msgflow.cli.output import print_result
    from msgflow.fleet.lake import Lake
    from msgflow.fleet.listing import list_failures

    print_result(list_failures(Lake.open(lake)), form, output, wide=wide)


app.command("query")(fleet_queries.query)
app.command("sql")(fleet_queries.sql)
app.command("worst")(fleet_queries.worst)
app.command("open")(fleet_queries.open_)


@app.command("remove")
def remove(
    keys: Annotated[list[str], typer.Argument(metavar="RUN...", help="Keys of runs")],
    lake: LakeOption,
) -> None:
    """Take runs out of a lake; their files go with the next `msgflow fleet compact`."""
    from msgflow.cli.output import print_status
    from msgflow.fleet.lake import Lake
    from msgflow.text.values import count

    removed = Lake.open(lake).remove(keys)
    print_status(f"{count(removed, 'run')} removed from {lake}")


@app.command("compact")
def compact(
    lake: LakeOption,
    older_than: Annotated[
        str,
        typer.Option(
            "--older-than",
            metavar="TIME",
            help="Delete files that have not been needed for so long: 2h, 1d. Longer than any"
            " reader or ingest of a recording takes",
        ),
    ] = "1d",
) -> None:
    """Put the answers of many runs into few files, and delete those that nobody needs."""
    seconds = _time(older_than, "--older-than")
    from msgflow.cli.output import print_status
    from msgflow.fleet.compact import compact as compacted
    from msgflow.fleet.lake import Lake
    from msgflow.text.values import count

    done = compacted(Lake.open(lake), older_than=seconds)
    print_status(
        f"answers of {count(done.packed, 'run')} put into {count(done.packs, 'part')};"
        f" {count(done.deleted, 'file')} deleted, {done.size / 1e6:,.1f} MB"
    )


@app.command("compare")
def compare(
    lake: LakeOption,
    by: Annotated[
        str, typer.Option("--by", metavar="LABEL", help="Label that tells the two sides apart")
    ],
    base: Annotated[
        str | None,
        typer.Argument(
            metavar="BASE",
            help="Its value on side A, which the other is compared with",
            show_default="the lesser, where there are two",
        ),
    ] = None,
    other: Annotated[
        str | None, typer.Argument(metavar="OTHER", help="Its value on side B")
    ] = None,
    where: Annotated[
        str | None,
        typer.Option(
            "--where",
            metavar="SQL",
            help="Only runs for which this holds: a condition on labels",
            show_default="all",
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(
            "--unit",
            metavar="LABEL",
            help="All runs with one value of this label count as one, such as those of a robot",
            show_default="each run for itself",
        ),
    ] = None,
    case: Annotated[
        str,
        case_option("Flows that count"),
    ] = "first",
    confidence: Annotated[
        float, typer.Option("--confidence", help="Confidence level of the intervals")
    ] = 0.95,
    fail_on: Annotated[
        list[str] | None,
        fail_on_option("side"),
    ] = None,
    only_different: Annotated[
        bool | None,
        only_different_option("path"),
    ] = None,
    form: FormatOption = None,
    output: OutputOption = None,
    wide: WideOption = False,
) -> None:
    """Compare paths in runs of one version (robot, site) with those of another.

    The run is the unit: how much runs of one side differ from each other tells
    whether the two sides differ.
    """
    from msgflow.fleet.compare import compare as compared
    from msgflow.fleet.lake import Lake
    from msgflow.query.compare import parse_conditions

    parse_conditions(fail_on or [])
    comparison = compared(
        Lake.open(lake),
        by,
        base,
        other,
        where=where,
        unit=unit,
        case=case,
        confidence=confidence,
    )
    print_comparison(comparison, fail_on or [], only_different, form=form, wide=wide, output=output)


def _labels(texts: list[str]) -> dict[str, str]:
    labels: dict[str, str] = {}
    for text in texts:
        key, sign, value = text.partition("=")
        if not (sign and value):
            raise UsageError(f"a label is KEY=VALUE — {text}", "--label site=berlin")
        if labels.setdefault(key, value) != value:
            raise UsageError(f"a recording has one label of a key — {key}", "give it once")
    if labels:
        from msgflow.db.runs import require_label

        for key, value in labels.items():
            require_label(key, value)
    return labels


def _size(text: str | None) -> int | None:
    if text is None:
        return None
    size = bytes_of(text)
    if not size:
        raise UsageError(f"--memory takes a size — {text}", "--memory 4GB")
    return size


def _time(text: str, option: str) -> float:
    match = _TIME.fullmatch(text.strip())
    if match is None:
        raise UsageError(f"{option} takes a time — {text}", f"{option} 90s, {option} 2h")
    return float(match[1]) * _SECONDS[match[2]]
