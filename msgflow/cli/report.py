"""`msgflow report`: the pages of a run in one file, or its summary as Markdown."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.options import (
    OUTPUT,
    SELECTION,
    DatabaseOption,
    LakePageOption,
    LakeWhereOption,
    MemoryLimitOption,
    PathsOption,
    bytes_of,
    output_option,
    targets_option,
)
from msgflow.cli.slice_options import with_slice
from msgflow.cli.ui import require_no_where
from msgflow.errors import UsageError
from msgflow.files.default_files import DEFAULT_DATABASE, DEFAULT_PATHS
from msgflow.run.slice import LATEST, Slice

# Browsers unpack larger pages too slowly.
_MOST = 1_000_000_000


@with_slice("run", "start", "end")
def command(
    output: Annotated[Path, output_option("FILE.html|FILE.md")] = Path("msgflow.html"),
    part: Slice = LATEST,
    compare: Annotated[
        str | None,
        typer.Option(
            "--compare",
            metavar="NAME|ID",
            help="Run to compare it with",
            rich_help_panel=SELECTION,
        ),
    ] = None,
    through: Annotated[
        str | None,
        typer.Option(
            "--through",
            metavar="TEXT",
            help="Only paths that contain this text: a topic, or a node",
            rich_help_panel=SELECTION,
        ),
    ] = None,
    max_size: Annotated[
        str,
        typer.Option(
            "--max-size",
            metavar="SIZE",
            help="Maximum size of the file; what does not fit is left out, and the page says so",
            rich_help_panel=OUTPUT,
        ),
    ] = "20MB",
    lake: LakePageOption = None,
    where: LakeWhereOption = None,
    targets: Annotated[
        Path | None,
        targets_option("the summary has the verdicts on them"),
    ] = None,
    paths: PathsOption = Path(DEFAULT_PATHS),
    memory_limit: MemoryLimitOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Write the pages of a run to one file that any browser opens, without a server.

    The first page is a summary. A file that ends with .md gets the summary alone, as Markdown.
    With --lake: a page of the paths of all its runs by label over time, outliers, failures.
    """
    from msgflow.cli.output import print_note, print_runs, print_status
    from msgflow.database import Database
    from msgflow.text.values import count

    is_page = output.suffix.lower() in (".html", ".htm")
    if not is_page and (lake is not None or output.suffix.lower() != ".md"):
        raise UsageError(
            f"a report is a page, or Markdown: its name ends with .html or .md — {output}",
            "-o FILE.html",
        )
    size = read_size(max_size)
    if lake is not None:
        if part != LATEST or any(given is not None for given in (compare, through, targets)):
            raise UsageError(
                "the page of a lake is of all its runs", "--where chooses some of them"
            )
        from msgflow.fleet.lake import Lake
        from msgflow.fleet.lake_page import write_lake_page

        page = write_lake_page(Lake.open(lake), output, where=where, max_size=size)
        for note in page.notes:
            print_note(note)
        print_status(f"{count(page.runs, 'run')} of {lake} in {output}: open it in a browser")
        return
    require_no_where(where)
    with Database(database, memory_limit=memory_limit) as opened:
        report = opened.report(
            output,
            run=part.run,
            compare=compare,
            targets=targets,
            paths=paths,
            start=part.start,
            end=part.end,
            path_text=through,
            max_size=size,
        )
    print_runs([report.run])
    for note in report.notes:
        print_note(note)
    what = ": open it in a browser" if is_page else ""
    print_status(f"{report.size:,} bytes written to {report.path}{what}")


def read_size(text: str) -> int:
    """Return the bytes that '20MB' means."""
    size = bytes_of(text)
    if not 0 < size <= _MOST:
        raise UsageError(f"cannot read the size — {text}", "--max-size 20MB, at most 1GB")
    return size
