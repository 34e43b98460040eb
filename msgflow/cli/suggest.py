"""Write links, paths or requirements that a run shows, as a file to review."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.operation import operation
from msgflow.cli.output import (
    command_text,
    print_next,
    print_note,
    print_runs,
    print_status,
    print_text,
)
from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.files.default_files import DEFAULT_LINKS, DEFAULT_PATHS
from msgflow.text.values import count

app = typer.Typer()

_SUGGEST = ("msgflow", "suggest")


@app.command("links")
@operation
def links(
    database: Database, *, run: str | None = None, apply: bool = False, output: Path | None = None
) -> None:
    """Print links that the data suggest, as a file to review.

    Doubtful ones are comments in it. Links that a file declared before stay in it. Without --apply
    nothing is applied. With it, the file is written and its links are declared, or nothing happens.

    Args:
        apply: Declare those without a doubt, and write the file (-o, else msgflow-links.yaml).
    """
    from msgflow.cli.links import print_applied
    from msgflow.files.atomic import replacing

    if run == "all":
        raise UsageError(
            "suggestions are a file for one run, which does not fit others — all",
            "msgflow suggest links --run NAME for each of them; msgflow runs names them",
        )
    if apply and output is None and DEFAULT_LINKS.exists():
        raise UsageError(
            f"there is a file of this name — {DEFAULT_LINKS}",
            f"-o {DEFAULT_LINKS} replaces it, -o FILE.yaml writes another",
        )
    path = output or (DEFAULT_LINKS if apply else None)
    words = ["msgflow", "links", "apply", str(path or "FILE")]
    found = database.suggest_links(run=run)
    print_runs(found.runs)
    if found.doubtful:
        print_note(
            f"{len(found.doubtful)} of {count(len(found.candidates), 'candidate')} are"
            " doubtful, see the comments: "
            + ", ".join(dict.fromkeys(row["node"] for row in found.doubtful))
        )
    text = found.text(command_text(words, database.path, run))
    if path is None or not apply or not found.certain:
        print_text(text, path)
        if apply:
            print_status("no candidate is without a doubt: nothing is declared")
        elif path is None and found.certain:
            print_next([*_SUGGEST, "links", "--apply"], database.path, run)
        return
    with replacing(path) as temporary:
        temporary.write_text(f"{text}\n", encoding="utf-8")
        applied = database.apply_links(path, run=run, content=text)
    for row in found.certain:
        print_status(
            f"{row['node']}: {', '.join(row['inputs'])} → {', '.join(row['outputs'])}"
            f" ({row['kind']})"
        )
    for one in applied:
        print_applied(database, one)
    print_status(f"written to {path}")


@app.command("paths")
@operation
def paths(database: Database, *, run: str | None = None, output: Path | None = None) -> None:
    """Print the paths of a run as a file with names, to choose from: paths.yaml."""
    from msgflow.paths.suggested_paths import suggest_paths

    result = database.query("e2e-latency", run=run)
    print_runs(result.runs)
    text = suggest_paths(result.to_arrow().to_pylist())
    for note in result.notes:
        if "cut off" in note:
            print_note(note)
    print_text(text, output)
    if output is None:
        print_next([*_SUGGEST, "paths", "-o", str(DEFAULT_PATHS)], database.path, run)


@app.command("targets")
@operation
def targets(
    database: Database,
    *,
    run: str | None = None,
    start: str | None = None,
    margin: Annotated[float, typer.Option(min=0)] = 20.0,
    output: Path | None = None,
) -> None:
    """Print requirements that a good run meets, as a file to review: -o targets.yaml.

    `msgflow verify targets.yaml` applies them to a run.
    It covers paths, timers, topics, services and actions with at least 20 values. A note and a
    comment in the file name topics that delivered less than 99 % of their messages.

    Args:
        margin (PERCENT): How much more than measured is allowed.
    """
    text = database.suggest_targets(run=run, start=start, margin=margin / 100)
    print_text(text, output)
    for line in text.splitlines()[1:]:
        if line.startswith("# "):
            print_note(line.removeprefix("# "))
    if text.endswith("targets: []"):
        print_note("nothing was measured often enough to suggest a requirement for it")
    elif output is None:
        print_next([*_SUGGEST, "targets", "-o", "targets.yaml"], database.path, run)
    else:
        # Another run is what they are for.
        print_next(["msgflow", "verify", str(output)], database.path)
