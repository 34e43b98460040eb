"""Read LTTng traces of a ROS 2 system into a database, each recording as a run."""

from __future__ import annotations

import os
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.cli.check import PLACES_SHOWN
from msgflow.cli.operation import operation
from msgflow.cli.options import Reader
from msgflow.cli.output import command_text, print_next, print_note, print_status
from msgflow.errors import UsageError
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.run.choice import require_run_name
from msgflow.sql.interrupt import noted_interrupts
from msgflow.text.values import count

if TYPE_CHECKING:
    from msgflow.ingest import IngestReport

ARCHIVES_SHOWN = 3
"""Most archives that a note names."""


@operation
def command(
    traces: list[str],
    *,
    name: str | None = None,
    together: bool = False,
    replace: bool = False,
    host: list[str] | None = None,
    keep_staging: Path | None = None,
    links: Path | None = None,
    clock_sync: str = "none",
    reader: Reader = "auto",
    strict: bool = False,
    ignore: list[str] | None = None,
    events: list[str] | None = None,
    memory_limit: str | None = None,
    quiet: bool = False,
    database: Path = DEFAULT_DATABASE,
) -> None:
    """Traces of one session, and sessions whose times overlap, are one recording.

    Args:
        traces (TRACE...): Directories with CTF traces, at any depth, or archives of such.
        name (NAME): Name of the run; by default that of its folder.
        together: One run of all traces, though they are recordings of different times.
        replace: Replace the run that already holds these traces.
        host (NAME=PATH): Name the host of the traces below PATH; may be repeated, with the same
            name too; the deepest PATH counts.
        keep_staging (DIR): Keep the raw events, as Parquet files in DIR.
        memory_limit: Maximum memory for the database, such as 2GB; more makes large traces faster.
            By default a quarter of the machine's, 500MB to 4GB.
    """
    hosts = _hosts(host or [])
    # From before the imports, which may lose Ctrl-C, until the stored run is reported.
    with noted_interrupts():
        from msgflow.cli.progress import ingest_progress
        from msgflow.database import Database
        from msgflow.db.finding import first_command
        from msgflow.ingest.recordings import Recording, find_recordings

        if name is not None:
            require_run_name(name)
        with (
            Database(database, memory_limit=memory_limit) as opened,
            ingest_progress(quiet) as progress,
        ):
            recordings = [Recording(traces, hosts)]
            # How far clocks are apart is not known before they are brought together.
            if not together and clock_sync == "none":
                recordings = find_recordings(traces, hosts, reader=reader)
            if len(recordings) > 1:
                for option, given in (("--name", name), ("--keep-staging", keep_staging)):
                    if given is not None:
                        raise UsageError(
                            f"{option} is for one run, these traces are {len(recordings)}"
                            " recordings whose times do not overlap",
                            f"--together makes one run; or leave out {option}",
                        )
                if not quiet:
                    print_note(
                        f"{len(recordings)} recordings, whose times do not overlap, become as many"
                        " runs: --together makes one"
                    )
            reports = []
            for recording in recordings:
                report = opened.ingest(
                    recording.paths,
                    name=name,
                    replace=replace,
                    hosts=recording.hosts,
                    keep_staging=keep_staging,
                    links=links,
                    clock_sync=clock_sync,
                    reader=reader,
                    strict=strict,
                    ignore=ignore or [],
                    events=events or [],
                    progress=progress,
                )
                reports.append(report)
                if not quiet:
                    _print_report(report, database)
                for warning in report.warnings:
                    print_note(warning)
            if not quiet:
                _note_archives(traces, database)
                findings = [each for report in reports for each in report.findings]
                words = first_command(findings)
                is_one = len(reports) == 1
                # Of several runs, `why` explains one.
                if not is_one and words == ("why",):
                    words = ("query", "e2e-latency")
                print_next(["msgflow", *words], database, None if is_one else "all")


def _note_archives(traces: list[str], database: Path) -> None:
    """Say which archives below the given directories were not read, and how to name them."""
    from msgflow.trace.discovery import archives_below

    archives = [str(path) for path in archives_below(traces)]
    if archives:
        verb = "was" if len(archives) == 1 else "were"
        words = ["msgflow", "ingest", *traces, *archives[:ARCHIVES_SHOWN], "--replace"]
        print_note(
            f"{count(len(archives), 'archive')} beside the traces {verb} not read; to read what is"
            f" of the same recording: {command_text(words, database)}"
        )


def _print_report(report: IngestReport, database: Path) -> None:
    print_status(
        f"{count(report.event_count, 'event')} read into {database} as run"
        f" {report.run_name} ({report.run_id}) in {report.seconds:.1f} s"
    )
    notable = [finding for finding in report.findings if finding.severity != "info"]
    for name, group in groupby(notable, key=lambda finding: finding.name):
        places = list(group)
        for finding in places[:PLACES_SHOWN]:
            print_note(f"{name} ({finding.count}): {finding.subject} — {finding.detail}")
        if len(places) > PLACES_SHOWN:
            print_note(f"{name}: {len(places) - PLACES_SHOWN} more places: msgflow check")


def _hosts(texts: list[str]) -> dict[str, list[str]]:
    hosts: dict[str, list[str]] = {}
    for text in texts:
        name, separator, path = text.partition("=")
        if not (name and separator and path):
            raise UsageError(f"--host takes NAME=PATH — {text}", "--host robot=traces/robot")
        hosts.setdefault(name, []).append(os.path.expanduser(path))
    return hosts
