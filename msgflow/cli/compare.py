"""`msgflow compare`: how one run differs from another, and whether it is worse than allowed."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from msgflow.cli.options import (
    DEFAULT_DATABASE,
    SELECTION,
    DatabaseOption,
    FormatOption,
    InternalOption,
    OutputOption,
)
from msgflow.errors import ExitCode

_METHOD = "How it is estimated"


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
    run_a: Annotated[str, typer.Argument(metavar="RUN_A", help="Run to compare with: name or id")],
    run_b: Annotated[str, typer.Argument(metavar="RUN_B", help="Run that is compared with it")],
    what: Annotated[
        Thing,
        typer.Option(
            "--what",
            help="Latency end to end by path, duration by callback, or from publication to take by"
            " topic",
            rich_help_panel=SELECTION,
        ),
    ] = Thing.PATHS,
    from_topic: Annotated[
        str | None,
        typer.Option(
            "--from", metavar="NAME", help="Topic where paths start", rich_help_panel=SELECTION
        ),
    ] = None,
    to_topic: Annotated[
        str | None,
        typer.Option(
            "--to", metavar="NAME", help="Topic where paths end", rich_help_panel=SELECTION
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
            help="Leave out the begin of each run, where the system warms up",
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
            help="Most paths, shortest first, and most chains per length",
            rich_help_panel=SELECTION,
        ),
    ] = 1_000,
    internal: InternalOption = False,
    fail_on: Annotated[
        list[str] | None,
        typer.Option(
            "--fail-on",
            metavar="CONDITION",
            help="Exit with 1 where run B exceeds run A by more: 'p95>5%', 'median>2ms', of median,"
            " mean, p95, p99, max; or where less arrives: 'share<-1%'; several may be given",
        ),
    ] = None,
    confidence: Annotated[
        float,
        typer.Option(
            "--confidence", metavar="SHARE", help="Of the intervals", rich_help_panel=_METHOD
        ),
    ] = 0.95,
    resamples: Annotated[
        int | None,
        typer.Option(
            "--resamples",
            metavar="N",
            help="Resamples that the intervals are from",
            show_default="1000, or 20 / (1 - confidence)",
            rich_help_panel=_METHOD,
        ),
    ] = None,
    seed: Annotated[
        int,
        typer.Option("--seed", help="Of the resampling", rich_help_panel=_METHOD),
    ] = 0,
    form: FormatOption = None,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Compare run B with run A: medians, means, percentiles, and whether it may be chance.

    low and high enclose the difference with the given confidence, as far as chance within these two
    recordings goes. The verdict is that B is longer or shorter where they have one sign. It does
    not tell how much the same system differs when it is started again.
    """
    from msgflow.cli.output import print_error, print_result
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
    print_result(comparison.result, form, output)
    failures = comparison.failures(fail_on or [])
    for failure in failures:
        print_error(f"{failure.condition}: {failure.reason} — {failure.subject}")
    if failures:
        raise typer.Exit(ExitCode.FAILED)
