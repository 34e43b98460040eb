"""Compare run B with run A, or two times of one run, with what chance explains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from msgflow.backports import Unpack
from msgflow.cli.operation import asks
from msgflow.cli.options import OUTPUT
from msgflow.cli.output import Shown, print_error, print_lines, print_note, print_result
from msgflow.database import Database
from msgflow.errors import ExitCode
from msgflow.export.formats import Format
from msgflow.result.layout import screen_width
from msgflow.text.values import printable
from msgflow.text.wrapping import wrap

if TYPE_CHECKING:
    from msgflow.query.compare import Comparison
    from msgflow.query.differences import Differences

# Rows on a terminal, where long paths take several lines.
_MOST_ROWS = 10
# The greatest change, and culprits.
_MOST_LINES = 4


def _read(conditions: list[str] | None) -> list[str]:
    """Read the conditions before anything is compared."""
    from msgflow.query.differences import parse_conditions

    parse_conditions(conditions or [])
    return conditions or []


FailOn = Annotated[
    list[str] | None,
    typer.Option(
        metavar="CONDITION",
        callback=_read,
        help="Exit with 1 if B exceeds A by more than that: 'p95>5%', 'median>2ms' (median, mean,"
        " p95, p99 or max), or if less arrives: 'share<-1%'; may be repeated",
    ),
]
EvenByChance = Annotated[
    bool,
    typer.Option("--even-by-chance", help="--fail-on counts differences that may be chance, too"),
]
OnlyDifferent = Annotated[
    bool | None,
    typer.Option(
        "--only-different/--all",
        help="One row for each path, callback or topic: those that differ, or all",
        show_default="in a table all; else every statistic",
        rich_help_panel=OUTPUT,
    ),
]


@asks(Database.compare)
def command(
    comparison: Comparison,
    *,
    fail_on: FailOn = None,
    even_by_chance: EvenByChance = False,
    only_different: OnlyDifferent = None,
    **shown: Unpack[Shown],
) -> None:
    """`msgflow compare RUN_A RUN_B --fail-on 'p95>5%'` is a check for CI."""
    print_comparison(comparison, fail_on or (), even_by_chance, only_different, **shown)


def print_comparison(
    comparison: Differences,
    fail_on: Sequence[str],
    even_by_chance: bool,
    only_different: bool | None,
    **shown: Unpack[Shown],
) -> None:
    """Print a comparison, and exit with 1 where a condition of `fail_on` holds."""
    result = comparison.result
    is_table = shown.get("form") in (None, Format.TABLE) and shown.get("output") is None
    if comparison.parts is not None:
        result = comparison.parts
    elif only_different is not None or (is_table and not shown.get("wide")):
        result = comparison.changes(only_different=only_different is True)
    if is_table:
        _print_begin(comparison.lines, None if shown.get("wide") else _MOST_LINES)
    print_result(result, **shown, most_rows=_MOST_ROWS)
    if not is_table:
        for line in comparison.lines:
            print_note(line)
    exceeding = comparison.failures(fail_on, even_by_chance=True)
    failures = [each for each in exceeding if even_by_chance or not each.may_be_chance]
    if number := len(exceeding) - len(failures):
        differences = "1 difference" if number == 1 else f"{number} differences"
        print_note(f"{differences} beyond a limit may be chance: --even-by-chance counts them")
    for failure in failures:
        print_error(f"{failure.condition}: {failure.reason} — {failure.subject}")
    if failures:
        raise typer.Exit(ExitCode.FAILED)


def _print_begin(lines: Sequence[str], most: int | None) -> None:
    shown = list(lines[:most])
    if more := len(lines) - len(shown):
        shown.append(f"{more} more (--wide)")
    width = screen_width()
    print_lines(text for line in shown for text in wrap(printable(line), width))
    if lines:
        print_lines([""])
