"""`msgflow paths`: paths with names."""

from __future__ import annotations

import typer

from msgflow.cli.options import DatabaseOption, OutputOption, RunOption
from msgflow.default_files import DEFAULT_DATABASE

app = typer.Typer()


@app.command("suggest")
def suggest(
    run: RunOption = None,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Print the paths of a run as a file with names, to choose from: paths.yaml."""
    from msgflow.cli.output import print_note, print_runs, print_text
    from msgflow.database import Database
    from msgflow.paths import suggest_paths

    with Database(database) as opened:
        result = opened.query("e2e-latency", run=run)
    print_runs(result.runs)
    text = suggest_paths(result.to_arrow().to_pylist())
    for note in result.notes:
        if "cut off" in note:
            print_note(note)
    print_text(text, output)
