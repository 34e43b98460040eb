"""`msgflow compare`: how one run differs from another, and whether it is worse than allowed."""

from __future__ import annotations

from inspect import Parameter, Signature
from keyword import iskeyword
from pathlib import Path
from typing import Annotated, Any

import typer

from msgflow.cli.completion import complete
from msgflow.cli.declared import given_of, parameter
from msgflow.cli.options import (
    OUTPUT,
    DatabaseOption,
    FormatOption,
    InternalOption,
    MemoryLimitOption,
    OutputOption,
    WideOption,
)
from msgflow.default_files import DEFAULT_DATABASE
from msgflow.errors import ExitCode
from msgflow.export.formats import Format
from msgflow.sql.statement import internal_sql

# On a terminal: paths are long.
_MOST_ROWS = 10
# Those that mean the same everywhere, and the two runs, are no options of its own.
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
_FailOnOption = Annotated[
    list[str] | None,
    typer.Option(
        "--fail-on",
        metavar="CONDITION",
        help="Exit with 1 if run B exceeds run A by more than that: 'p95>5%', 'median>2ms'"
        " (median, mean, p95, p99 or max), or if less arrives: 'share<-1%'; may be repeated",
    ),
]
_OnlyDifferentOption = Annotated[
    bool | None,
    typer.Option(
        "--only-different/--all",
        help="One row for each path, callback or topic: those that differ, or all",
        show_default="on a terminal those that differ; else every statistic",
        rich_help_panel=OUTPUT,
    ),
]


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
    from msgflow.cli.output import is_screen, print_error, print_result
    from msgflow.database import Database
    from msgflow.query.compare import parse_conditions

    parse_conditions(fail_on or [])
    with Database(database, memory_limit=memory_limit) as opened:
        given = {name + "_" * iskeyword(name): value for name, value in given_of(own).items()}
        comparison = opened.compare(run_a, run_b, internal=internal, **given)
    result = comparison.result
    is_table = form in (None, Format.TABLE) and output is None
    if only_different is not None or (is_table and not wide and is_screen()):
        result = comparison.changes(only_different=only_different is not False)
    print_result(result, form, output, wide=wide, most_rows=_MOST_ROWS)
    failures = comparison.failures(fail_on or [])
    for failure in failures:
        print_error(f"{failure.condition}: {failure.reason} — {failure.subject}")
    if failures:
        raise typer.Exit(ExitCode.FAILED)


def _signature() -> Signature:
    """Return the options: those of the statement, and those of the command."""
    positional, keyword = Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY
    declared = (p for p in internal_sql().header("comparison").params if p.name not in _COMMON)
    return Signature(
        [
            Parameter("run_a", positional, annotation=_RunA),
            Parameter("run_b", positional, annotation=_RunB),
            *(parameter(param) for param in declared),
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
    )


_SIGNATURE = _signature()
command.__signature__ = _SIGNATURE  # type: ignore[attr-defined]
command.__annotations__ = {name: each.annotation for name, each in _SIGNATURE.parameters.items()}
