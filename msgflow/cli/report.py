"""Write the pages of a run to one file that any browser opens, without a server."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from msgflow.cli.operation import extends
from msgflow.cli.options import bytes_of
from msgflow.cli.output import print_note, print_runs, print_status
from msgflow.database import Database
from msgflow.errors import UsageError

# Browsers unpack larger pages too slowly.
_MOST = 1_000_000_000


@extends(Database.report)
def command(
    database: Database,
    *,
    output: Path = Path("msgflow.html"),
    max_size: str = "20MB",
    **asked: Any,
) -> None:
    """The first page is a summary. A file that ends with .md gets the summary alone, as Markdown.

    Args:
        output (FILE.html|FILE.md): File to write or replace; - writes the page to stdout.
        max_size (SIZE): Maximum size of the file; what does not fit is left out, and the page says
            so.
    """
    to_stdout = str(output) == "-"
    is_page = to_stdout or output.suffix.lower() in (".html", ".htm")
    if not is_page and output.suffix.lower() != ".md":
        raise UsageError(
            f"a report is a page, or Markdown: its name ends with .html or .md — {output}",
            "-o FILE.html",
        )
    size = bytes_of(max_size, "--max-size 20MB, at most 1GB", _MOST)
    with TemporaryDirectory() as directory:
        target = Path(directory) / "report.html" if to_stdout else output
        report = database.report(target, max_size=size, **asked)
        print_runs([report.run])
        for note in report.notes:
            print_note(note)
        if to_stdout:
            sys.stdout.buffer.write(target.read_bytes())
        else:
            status = f"{report.size:,} bytes written to {target}"
            print_status(status + ": open it in a browser" * is_page)
