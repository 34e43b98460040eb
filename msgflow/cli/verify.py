"""`msgflow verify`: requirements of a file, checked in a run."""

from __future__ import annotations

from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.options import (
    DatabaseOption,
    OutputOption,
    PathsOption,
    WideOption,
    case_option,
    format_option,
)
from msgflow.cli.slice_options import with_slice
from msgflow.errors import ExitCode
from msgflow.files.default_files import DEFAULT_DATABASE, DEFAULT_PATHS
from msgflow.run.slice import LATEST, Slice


class VerifyFormat(StrEnum):
    """Formats of verdicts."""

    TABLE = "table"
    JSON = "json"
    CSV = "csv"
    MARKDOWN = "markdown"
    JUNIT = "junit"


@with_slice()
def command(
    targets: Annotated[Path, typer.Argument(metavar="TARGETS", help="Requirements, as YAML")],
    part: Slice = LATEST,
    paths: PathsOption = Path(DEFAULT_PATHS),
    case: Annotated[
        str,
        case_option("Flows that count for latencies of paths"),
    ] = "first",
    allow_not_measured: Annotated[
        bool,
        typer.Option(
            "--allow-not-measured",
            help="Exit with 0 if nothing failed, even if something has no value",
        ),
    ] = False,
    form: Annotated[
        VerifyFormat | None,
        format_option("Output format", show_default="junit into FILE.xml, else table"),
    ] = None,
    output: OutputOption = None,
    wide: WideOption = False,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Check a run against a file of requirements: passed, failed, not measured, no data.

    Exit code: 0 if all passed, 1 if one failed, 5 if none failed but one has no value.
    `msgflow suggest targets` writes such a file from a good run.
    """
    from msgflow.cli.output import print_result, print_runs, print_status, print_text
    from msgflow.database import Database
    from msgflow.export.formats import Format
    from msgflow.verify import Verdict

    with Database(database) as opened:
        verification = opened.verify(targets, paths=paths, case=case, **asdict(part))
    if form is None and output is not None and output.suffix.lower() == ".xml":
        form = VerifyFormat.JUNIT
    if form is VerifyFormat.JUNIT:
        print_runs([verification.run])
        text = verification.to_junit(allow_not_measured=allow_not_measured)
        print_text(text, output)
    else:
        chosen = None if form is None else Format(form.value)
        print_result(verification.result, chosen, output, wide=wide)
    # A table has what failed; of what has no value, it may lack room for the reason.
    for line in verification.unmet(with_value=form is VerifyFormat.JUNIT or output is not None):
        print_status(line)
    numbers = {verdict: verification.count(verdict) for verdict in Verdict}
    print_status(", ".join(f"{number} {verdict}" for verdict, number in numbers.items()))
    if numbers[Verdict.FAILED]:
        raise typer.Exit(ExitCode.FAILED)
    if numbers[Verdict.NOT_MEASURED] + numbers[Verdict.NO_DATA] and not allow_not_measured:
        raise typer.Exit(ExitCode.NOT_MEASURED)
