"""Write the pages of a run to one file that any browser opens, without a server."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

from msgflow.cli.operation import extends
from msgflow.cli.options import LAKE_PAGE, bytes_of
from msgflow.cli.output import print_note, print_runs, print_status
from msgflow.cli.ui import require_no_where
from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.text.values import count

# Browsers unpack larger pages too slowly.
_MOST = 1_000_000_000


@extends(Database.report)
def command(
    database: Database,
    *,
    output: Path = Path("msgflow.html"),
    max_size: str = "20MB",
    lake: Annotated[str | None, LAKE_PAGE] = None,
    where: str | None = None,
    **asked: Any,
) -> None:
    """The first page is a summary. A file that ends with .md gets the summary alone, as Markdown.
    With --lake: a page of the paths of all its runs by label over time, outliers, failures.

    Args:
        output (FILE.html|FILE.md): File to write or replace; - writes the page to stdout.
        max_size (SIZE): Maximum size of the file; what does not fit is left out, and the page says
            so.
    """
    to_stdout = str(output) == "-"
    is_page = to_stdout or output.suffix.lower() in (".html", ".htm")
    if not is_page and (lake is not None or output.suffix.lower() != ".md"):
        raise UsageError(
            f"a report is a page, or Markdown: its name ends with .html or .md — {output}",
            "-o FILE.html",
        )
    size = bytes_of(max_size, "--max-size 20MB, at most 1GB", _MOST)
    if lake is None:
        require_no_where(where)
    elif asked.keys() - {"paths"}:
        raise UsageError("the page of a lake is of all its runs", "--where chooses some of them")
    with TemporaryDirectory() as directory:
        target = Path(directory) / "report.html" if to_stdout else output
        if lake is not None:
            from msgflow.fleet.lake import Lake
            from msgflow.fleet.lake_page import write_lake_page

            page = write_lake_page(Lake.open(lake), target, where=where, max_size=size)
            notes = page.notes
            status = f"{count(page.runs, 'run')} of {lake} in {target}"
        else:
            report = database.report(target, max_size=size, **asked)
            print_runs([report.run])
            notes = report.notes
            status = f"{report.size:,} bytes written to {target}"
        for note in notes:
            print_note(note)
        if to_stdout:
            sys.stdout.buffer.write(target.read_bytes())
        else:
            print_status(status + ": open it in a browser" * is_page)
