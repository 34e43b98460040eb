"""`msgflow db`: the database file itself."""

from __future__ import annotations

import typer

from msgflow.cli.options import DatabaseOption, FormatOption, OutputOption, WideOption
from msgflow.default_files import DEFAULT_DATABASE
from msgflow.errors import ExitCode

app = typer.Typer()


@app.command("upgrade")
def upgrade(database: DatabaseOption = DEFAULT_DATABASE) -> None:
    """Upgrade a database to the schema and views of this version of msgflow."""
    from msgflow.cli.output import count, print_status
    from msgflow.db.migrate import upgrade as upgrade_database

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
    wide: WideOption = False,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Audit the database itself: whether its tables agree with each other.

    What is wrong with a recording, with cause and cure, is shown by `msgflow check`. The exit code
    is 1 when an audit finds an error.
    """
    import pyarrow

    from msgflow.cli.output import is_screen, print_note, print_result
    from msgflow.database import Database
    from msgflow.query.result import QueryResult

    with Database(database) as opened:
        results = opened.check()
    table = pyarrow.table(
        {
            "check": pyarrow.array([result.name for result in results], "string"),
            "severity": pyarrow.array([result.severity for result in results], "string"),
            "offending_rows": pyarrow.array([result.row_count for result in results], "int64"),
            "description": pyarrow.array([result.description for result in results], "string"),
        }
    )
    is_short = form is None and output is None and not wide and is_screen()
    columns = "check,severity,offending_rows" if is_short else None
    print_result(QueryResult(table), form, output, wide=wide, columns=columns)
    for result in results:
        if is_short and result.row_count:
            print_note(f"{result.name} does not hold: {result.description}")
    if any(result.row_count and result.severity == "error" for result in results):
        raise typer.Exit(ExitCode.FAILED)


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
