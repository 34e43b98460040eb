"""`msgflow links`: indirect links that the application did not declare itself."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.options import DatabaseOption, FormatOption, OutputOption, RunOption, WideOption
from msgflow.default_files import DEFAULT_DATABASE
from msgflow.errors import UsageError

app = typer.Typer()


@app.command("apply")
def apply(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Links to declare, as YAML")],
    run: RunOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Declare the links of a file and derive all links of the run again, without the trace."""
    from msgflow.cli.output import count, print_note, print_runs, print_status
    from msgflow.database import Database

    with Database(database) as opened:
        for one in opened.apply_links(file, run=run):
            print_runs([one.run])
            known = f", {one.known_count} of them by the trace itself" if one.known_count else ""
            traced = f", and {one.traced_link_count} that the trace declares itself"
            print_status(
                f"{count(one.annotation_count, 'link')} declared{known}:"
                f" {count(one.link_count, 'indirect link')} between messages"
                f"{traced if one.traced_link_count else ''}"
            )
            findings = opened.query(
                "info-findings", run=one.run.run_id, where="name = 'contradictory_annotations'"
            )
            for finding in findings.to_arrow().to_pylist():
                print_note(f"{finding['name']} ({finding['count']}): {finding['detail']}")


@app.command("suggest")
def suggest(
    run: RunOption = None,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Print candidates found in the data, as a file to review; nothing is applied."""
    from msgflow.cli.output import count, print_note, print_runs, print_text
    from msgflow.database import Database
    from msgflow.links import suggest_links

    if run == "all":
        raise UsageError(
            "suggestions are a file for one run, which does not fit others — all",
            "msgflow links suggest --run NAME for each of them; msgflow query info names them",
        )
    with Database(database) as opened:
        result = opened.query("links-suggested", run=run)
    print_runs(result.runs)
    words = ["msgflow", "links", "apply", str(output or "FILE")]
    words += ["--run", run] if run is not None else []
    words += ["--db", str(database)] if database != DEFAULT_DATABASE else []
    rows = result.to_arrow().to_pylist()
    text = suggest_links(rows, shlex.join(words))
    doubtful = sum(row["doubt"] is not None for row in rows)
    if doubtful:
        print_note(
            f"{doubtful} of {count(len(rows), 'candidate')} are doubtful, see the comments: "
            + ", ".join(dict.fromkeys(row["node"] for row in rows if row["doubt"]))
        )
    print_text(text, output)


@app.command("list")
def list_links(
    run: RunOption = None,
    form: FormatOption = None,
    wide: WideOption = False,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """List the declared links and what they explain (the query links)."""
    from msgflow.cli.output import print_result
    from msgflow.database import Database

    with Database(database) as opened:
        result = opened.query("links", run=run)
    print_result(result, form, output, wide=wide)
