"""What became of a goal: what took longest, and below it the stages in order."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.cli.culprits import culprit_lines
from msgflow.cli.output import command_text, print_note, print_runs
from msgflow.cli.sections import SectionsFormat, print_sections, screen_sections

if TYPE_CHECKING:
    from msgflow.query.story import Story

_SHOWN = "at_ns took_ns step node what share request_id"


def print_story(
    found: Story, form: SectionsFormat, output: Path | None, database: Path, *, wide: bool
) -> None:
    """Print a story to a file or stdout."""

    def brief(width: int) -> Iterator[str]:
        yield from culprit_lines(
            found.verdict, lambda words: command_text(["msgflow", *words], database), width
        )
        shown = found.steps.with_columns(_SHOWN.split())
        yield from screen_sections({"story": shown}, width)

    print_runs([found.run])
    print_sections(found.sections, form, output, None if wide else brief)
    for note in found.notes:
        print_note(note)
