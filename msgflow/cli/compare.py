"""`msgflow compare`: how one run differs from another, and whether it is worse than allowed."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from msgflow.cli.completion import complete
from msgflow.cli.defaults import DEFAULT_DATABASE
from msgflow.cli.options import (
    OUTPUT,
    SELECTION,
    DatabaseOption,
    FormatOption,
    InternalOption,
    OutputOption,
    WideOption,
)
from msgflow.errors import ExitCode
from msgflow.export.formats import Format

_METHOD = "How it is estimated"
# On a terminal: paths are long.
_MOST_ROWS = 10


class Thing(StrEnum):
    """What is compared."""

    PATHS = "paths"
    CALLBACKS = "callbacks"
    TOPICS = "topics"


class Case(StrEnum):
    """Which arrivals of a path count."""

    FIRST = "first"
    LAST = "last"
    NEWEST = "newest"
    EVERY_PAIR = "every_pair"


def command(
    run_a: Annotated[
        str,
        typer.Argument(
            metavar="RUN_A", help="Baseline run: name or id", autocompletion=complete("run")
        ),
    ],
    run_b: Annotated[
        str,
        typer.Argument(
            metavar="RUN_B", help="Run to compare with it", autocompletion=complete("run")
        ),
    ],
    what: Annotated[
        Thing,
        typer.Option(
            "--what",
            help="End-to-end latency of paths, duration of callbacks, or time from publication to"
            " take of topics",
            rich_help_panel=SELECTION,
        ),
    ] = Thing.PATHS,
    from_topic: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="NAME",
            help="Topic where paths start",
            autocompletion=complete("topic"),
            rich_help_panel=SELECTION,
        ),
    ] = None,
    to_topic: Annotated[
        str | None,
        typer.Option(
            "--to",
            metavar="NAME",
            help="Topic where paths end",
            autocompletion=complete("topic"),
            rich_help_panel=SELECTION,
        ),
    ] = None,
    case: Annotated[
        Case,
        typer.Option(
            "--case",
            help="First or last arrival of each root, newest root of each arrival, or all pairs",
            rich_help_panel=SELECTION,
        ),
    ] = Case.FIRST,
    skip_first: Annotated[
        float,
        typer.Option(
            "--skip-first",
            metavar="SECONDS",
            min=0,
            help="Skip the first SECONDS of each run (warm-up)",
            rich_help_panel=SELECTION,
        ),
    ] = 0.0,
    max_depth: Annotated[
        int,
        typer.Option(
            "--max-depth",
            metavar="N",
            min=1,
            help="Longest path, in topics",
            rich_help_panel=SELECTION,
        ),
    ] = 32,
    max_paths: Annotated[
        int,
        typer.Option(
            "--max-paths",
            metavar="N",
            min=1,
            help="Maximum number of paths, shortest first; also the limit on chains of each length",
            rich_help_panel=SELECTION,
        ),
    ] = 1_000,
    internal: InternalOption = False,
    fail_on: Annotated[
        list[str] | None,
        typer.Option(
            "--fail-on",
            metavar="CONDITION",
            help="Exit with 1 if run B exceeds run A by more than that: 'p95>5%', 'median>2ms'"
            " (median, mean, p95, p99 or max), or if less arrives: 'share<-1%'; may be repeated",
        ),
    ] = None,
    only_different: Annotated[
        bool | None,
        typer.Option(
            "--only-different/--all",
            help="One row for each path, callback or topic: those that differ, or all",
            show_default="on a terminal those that differ; else every statistic",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    confidence: Annotated[
        float,
        typer.Option(
            "--confidence",
            metavar="SHARE",
            help="Confidence level of the intervals",
            rich_help_panel=_METHOD,
        ),
    ] = 0.95,
    resamples: Annotated[
        int | None,
        typer.Option(
            "--resamples",
            metavar="N",
            help="Number of resamples for the intervals; 0 for no intervals",
            show_default="1000, or 20 / (1 - confidence) if that is more",
            rich_help_panel=_METHOD,
        ),
    ] = None,
    seed: Annotated[
        int,
        typer.Option("--seed", help="Random seed", rich_help_panel=_METHOD),
    ] = 0,
    form: FormatOption = None,
    wide: WideOption = False,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
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
    with Database(database) as opened:
        comparison = opened.compare(
            run_a,
            run_b,
            what=what.value,
            from_=from_topic,
            to=to_topic,
            case=case.value,
            skip_first=skip_first,
            confidence=confidence,
            resamples=resamples,
            seed=seed,
            internal=internal,
            max_depth=max_depth,
            max_paths=max_paths,
        )
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
