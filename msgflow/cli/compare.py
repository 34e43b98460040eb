"""`msgflow compare`: differences of two runs, and conditions under which they fail."""

from __future__ import annotations

from inspect import Parameter
from keyword import iskeyword
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msgflow.cli.completion import complete
from msgflow.cli.header_options import given_of, header_parameter
from msgflow.cli.options import (
    OUTPUT,
    DatabaseOption,
    FormatOption,
    InternalOption,
    MemoryLimitOption,
    OutputOption,
    WideOption,
)
from msgflow.cli.slice_options import set_parameters
from msgflow.errors import ExitCode
from msgflow.export.formats import Format
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Sequence

    from msgflow.fleet.compare import FleetComparison
    from msgflow.query.compare import Comparison

# Rows on a terminal, where long paths take several lines.
_MOST_ROWS = 10
# Parameters of the statement that the command passes by itself.
_COMMON = ("run_a", "run_b", "internal")
_RunA = Annotated[
    str,
    typer.Argument(
        metavar="RUN_A", help="Baseline run: name or id", autocompletion=complete("run")
    ),
]
_RunB = Annotated[
    str,
    typer.Argument(metavar="RUN_B", help="Run to compare with it", autocompletion=complete("run")),
]


def fail_on_option(side: str) -> Any:
    """Return the option for the conditions that fail a comparison of sides A and B."""
    return typer.Option(
        "--fail-on",
        metavar="CONDITION",
        help=f"Exit with 1 if {side} B exceeds {side} A by more than that: 'p95>5%', 'median>2ms'"
        " (median, mean, p95, p99 or max), or if less arrives: 'share<-1%'; may be repeated",
    )


def only_different_option(subject: str) -> Any:
    """Return the option for the rows of a comparison: one for each subject, or all."""
    return typer.Option(
        "--only-different/--all",
        help=f"One row for each {subject}: those that differ, or all",
        show_default="on a terminal all; else every statistic",
        rich_help_panel=OUTPUT,
    )


_FailOnOption = Annotated[list[str] | None, fail_on_option("run")]
_OnlyDifferentOption = Annotated[bool | None, only_different_option("path, callback or topic")]


def command(
    run_a: str,
    run_b: str,
    *,
    internal: bool,
    fail_on: list[str] | None,
    only_different: bool | None,
    form: Format | None,
    wide: bool,
    output: Path | None,
    memory_limit: str | None,
    database: Path,
    **own: Any,
) -> None:
    """Compare run B with run A: medians, means, percentiles, and whether it may be chance.

    low and high enclose the difference with the given confidence. If both have
    the same sign, the verdict is that B is longer or shorter. This concerns
    chance within these two recordings only: it does not say how much the same
    system differs when it is started again.
    """
    from msgflow.database import Database
    from msgflow.query.compare import parse_conditions

    parse_conditions(fail_on or [])
    with Database(database, memory_limit=memory_limit) as opened:
        given = {name + "_" * iskeyword(name): value for name, value in given_of(own).items()}
        comparison = opened.compare(run_a, run_b, internal=internal, **given)
    print_comparison(comparison, fail_on or [], only_different, form=form, wide=wide, output=output)


def print_comparison(
    comparison: Comparison | FleetComparison,
    fail_on: Sequence[str],
    only_different: bool | None,
    *,
    form: Format | None,
    wide: bool,
    output: Path | None,
) -> None:
    """Print a comparison, and exit with 1 where a condition of `fail_on` holds."""
    from msgflow.cli.output import is_screen, print_error, print_result

    result = comparison.result
    is_table = form in (None, Format.TABLE) and output is None
    if only_different is not None or (is_table and not wide and is_screen()):
        result = comparison.changes(only_different=only_different is True)
    print_result(result, form, output, wide=wide, most_rows=_MOST_ROWS)
    failures = comparison.failures(fail_on)
    for failure in failures:
        print_error(f"{failure.condition}: {failure.reason} — {failure.subject}")
    if failures:
        raise typer.Exit(ExitCode.FAILED)


def _parameters() -> list[Parameter]:
    """Return the parameters of the command: those of the statement, then its own options."""
    positional, keyword = Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY
    declared = (p for p in internal_sql().header("comparison").params if p.name not in _COMMON)
    return [
        Parameter("run_a", positional, annotation=_RunA),
        Parameter("run_b", positional, annotation=_RunB),
        *(header_parameter(param) for param in declared),
        *(
            Parameter(name, keyword, default=default, annotation=annotation)
            for name, annotation, default in (
                ("internal", InternalOption, False),
                ("fail_on", _FailOnOption, None),
                ("only_different", _OnlyDifferentOption, None),
                ("form", FormatOption, None),
                ("wide", WideOption, False),
                ("output", OutputOption, None),
                ("memory_limit", MemoryLimitOption, None),
                ("database", DatabaseOption, DEFAULT_DATABASE),
            )
        ),
    ]


set_parameters(command, _parameters())
