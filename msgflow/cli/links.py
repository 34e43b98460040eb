"""`msgflow links`: indirect links that the application did not declare itself."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msgflow.cli.options import DatabaseOption, FormatOption, OutputOption, RunOption, WideOption
from msgflow.default_files import DEFAULT_DATABASE, DEFAULT_LINKS
from msgflow.errors import UsageError

if TYPE_CHECKING:
    from msgflow.database import Database
    from msgflow.links import AppliedLinks

app = typer.Typer()


@app.command("apply")
def apply(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Links to declare, as YAML")],
    run: RunOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Declare the links of a file and derive all links of the run again, without the trace."""
    from msgflow.cli.output import print_runs
    from msgflow.database import Database

    with Database(database) as opened:
        for one in opened.apply_links(file, run=run):
            print_runs([one.run])
            _print_applied(opened, one)


def _print_applied(opened: Database, one: AppliedLinks) -> None:
    from msgflow.cli.output import count, print_note, print_status

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
    apply: Annotated[
        bool,
        typer.Option(
            "--apply",
            help=f"Declare those without a doubt, and write the file (-o, else {DEFAULT_LINKS})",
        ),
    ] = False,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Print candidates found in the data, as a file to review.

    Doubtful ones are comments in it. Links that a file declared before stay in it.
    Without --apply nothing is applied. With it, the file is written and its links
    are declared, or nothing happens.
    """
    from msgflow.atomic import replacing
    from msgflow.cli.output import count, print_note, print_runs, print_status, print_text
    from msgflow.database import Database

    if run == "all":
        raise UsageError(
            "suggestions are a file for one run, which does not fit others — all",
            "msgflow links suggest --run NAME for each of them; msgflow query info names them",
        )
    if apply and output is None and DEFAULT_LINKS.exists():
        raise UsageError(
            f"there is a file of this name — {DEFAULT_LINKS}",
            f"-o {DEFAULT_LINKS} replaces it, -o FILE.yaml writes another",
        )
    path = output or (DEFAULT_LINKS if apply else None)
    words = ["msgflow", "links", "apply", str(path or "FILE")]
    words += ["--run", run] if run is not None else []
    words += ["--db", str(database)] if database != DEFAULT_DATABASE else []
    with Database(database) as opened:
        found = opened.suggest_links(run=run)
        print_runs(found.runs)
        if found.doubtful:
            print_note(
                f"{len(found.doubtful)} of {count(len(found.candidates), 'candidate')} are"
                " doubtful, see the comments: "
                + ", ".join(dict.fromkeys(row["node"] for row in found.doubtful))
            )
        text = found.text(shlex.join(words))
        if path is None or not apply or not found.certain:
            print_text(text, path)
            if apply:
                print_status("no candidate is without a doubt: nothing is declared")
            return
        with replacing(path) as temporary:
            temporary.write_text(f"{text}\n", encoding="utf-8")
            applied = opened.apply_links(path, run=run, content=text)
        for row in found.certain:
            print_status(
                f"{row['node']}: {', '.join(row['inputs'])} → {', '.join(row['outputs'])}"
                f" ({row['kind']})"
            )
        for one in applied:
            _print_applied(opened, one)
        print_status(f"written to {path}")


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
