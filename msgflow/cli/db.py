"""`msgflow db`: the database file itself."""

from __future__ import annotations

import typer

from msgflow.cli.options import DatabaseOption, FormatOption, OutputOption, WideOption
from msgflow.default_files import DEFAULT_DATABASE

app = typer.Typer()


@app.command("upgrade")
def upgrade(database: DatabaseOption = DEFAULT_DATABASE) -> None:
    """Upgrade a database to the schema and views of this version of msgflow."""
    from msgflow.cli.output import count, print_status
    from msgflow.db.migration import upgrade as upgrade_database

    done = upgrade_database(database)
    if done.before == done.after and not done.views_changed and not done.rederived_runs:
        print_status(f"{database} is up to date (schema revision {done.after})")
        return
    print_status(f"{database}: schema revision {done.before or 'none'} to {done.after}")
    if done.rederived_runs:
        print_status(f"links derived anew for {count(len(done.rederived_runs), 'run')}")


@app.command("check")
def check(
    form: FormatOption = None,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Check the database itself: whether its tables agree with each other.

    What is wrong with a recording, with cause and cure, is shown by `msgflow check`. The exit code
    is 1 when a rule is broken.
    """
    from msgflow.cli.check import report
    from msgflow.database import Database

    with Database(database) as opened:
        findings = opened.check()
        names = {known.run_id: known.title for known in opened.runs()}
    report(findings, form, output, run_labels=names, of="database")


@app.command("schema")
def schema(
    form: FormatOption = None,
    wide: WideOption = False,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """List the public views: one row per column, with its type and meaning."""
    from msgflow.cli.output import print_result
    from msgflow.database import Database

    with Database(database) as opened:
        result = opened.schema()
    print_result(result, form, output, wide=wide)
