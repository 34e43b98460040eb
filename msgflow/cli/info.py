"""Print what a database holds: runs, hosts, processes, nodes, topics, counts, data quality."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

from msgflow.cli.operation import header_option, operation
from msgflow.cli.options import SELECTION
from msgflow.cli.output import is_screen, print_note
from msgflow.cli.query_command import build_command, choice_of, chosen_by
from msgflow.cli.sections import SectionsFormat, chosen_format, print_sections, screen_sections
from msgflow.database import Database
from msgflow.query.catalogue import load_query

SECTIONS = ("runs", "hosts", "processes", "nodes", "topics", "counts", "findings")
(_SECTION,) = load_query("info").variants


def asked(words: list[str]) -> Any:
    """Return the command of the query, where a section is chosen."""
    return build_command(chosen_by("info", words)) if choice_of((_SECTION,), words) else None


@operation
def command(
    database: Database,
    *,
    section: Annotated[str | None, header_option(_SECTION, SELECTION)] = None,
    run: str | None = None,
    internal: bool = False,
    form: SectionsFormat | None = None,
    output: Path | None = None,
    wide: bool = False,
) -> None:
    """With --section it takes the options of queries: msgflow info --section nodes --help.

    Args:
        form (table|json|markdown): By default by the suffix of FILE, else table.
    """
    form = chosen_format(form, output)
    # Its topics are a query of their own.
    results = {
        section: database.query("topics", run=run, internal=internal)
        if section == "topics"
        else database.query(
            "info", run="all" if section == "runs" else run, internal=internal, section=section
        )
        for section in SECTIONS
    }
    # A pager may read the rest for long: others can write to the database meanwhile.
    database.close()
    is_brief = output is None and is_screen() and not wide
    print_sections(results, form, output, partial(screen_sections, results) if is_brief else None)
    for section, result in results.items():
        for note in result.notes:
            print_note(f"{section}: {note}")
