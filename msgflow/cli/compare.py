"""Compare run B with run A, or two times of one run, with what chance explains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Unpack

import typer

from msgflow.cli.operation import asks
from msgflow.cli.options import OUTPUT
from msgflow.cli.output import Shown, print_error, print_result
from msgflow.database import Database
from msgflow.errors import ExitCode
from msgflow.export.formats import Format

if TYPE_CHECKING:
    from msgflow.query.compare import Comparison
    from msgflow.query.differences import Differences

# Rows on a terminal, where long paths take several lines.
_MOST_ROWS = 10


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
    only_different: OnlyDifferent = None,
    **shown: Unpack[Shown],
) -> None:
    """`msgflow compare RUN_A RUN_B --fail-on 'p95>5%'` is a check for CI."""
    print_comparison(comparison, fail_on or (), only_different, **shown)


def print_comparison(
    comparison: Differences,
    fail_on: Sequence[str],
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
    print_result(result, **shown, most_rows=_MOST_ROWS)
    failures = comparison.failures(fail_on)
    for failure in failures:
        print_error(f"{failure.condition}: {failure.reason} — {failure.subject}")
    if failures:
        raise typer.Exit(ExitCode.FAILED)
