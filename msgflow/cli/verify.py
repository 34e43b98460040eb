"""Check a run against a file of requirements: passed, failed, not measured, no data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from msgflow.cli.operation import asks
from msgflow.cli.output import print_result, print_runs, print_status, print_text
from msgflow.database import Database
from msgflow.errors import ExitCode
from msgflow.export.formats import Format

if TYPE_CHECKING:
    from msgflow.verify.verify import Verification


@asks(Database.verify)
def command(
    verification: Verification,
    *,
    allow_not_measured: bool = False,
    form: Literal["table", "json", "csv", "markdown", "junit"] | None = None,
    output: Path | None = None,
    wide: bool = False,
) -> None:
    """Exit code: 0 if all passed, 1 if one failed, 5 if none failed but one has no value.

    `msgflow suggest targets` writes such a file from a good run.

    Args:
        allow_not_measured: Exit with 0 if nothing failed, even if something has no value.
        form (table|json|csv|markdown|junit): By default junit into FILE.xml, else table.
    """
    from msgflow.verify.verify import Verdict

    if form is None and output is not None and output.suffix.lower() == ".xml":
        form = "junit"
    if form == "junit":
        print_runs([verification.run])
        text = verification.to_junit(allow_not_measured=allow_not_measured)
        print_text(text, output)
    else:
        chosen = None if form is None else Format(form)
        print_result(verification.result, chosen, output, wide=wide)
    # A table has what failed; of what has no value, it may lack room for the reason.
    for line in verification.unmet(with_value=form == "junit" or output is not None):
        print_status(line)
    numbers = {verdict: verification.count(verdict) for verdict in Verdict}
    print_status(", ".join(f"{number} {verdict}" for verdict, number in numbers.items()))
    if numbers[Verdict.FAILED]:
        raise typer.Exit(ExitCode.FAILED)
    if numbers[Verdict.NOT_MEASURED] + numbers[Verdict.NO_DATA] and not allow_not_measured:
        raise typer.Exit(ExitCode.NOT_MEASURED)
