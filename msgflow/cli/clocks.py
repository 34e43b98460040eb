"""`msgflow clocks`: the clocks of several hosts."""

from __future__ import annotations

from typing import Annotated

import typer

from msgflow.cli.options import (
    DatabaseOption,
    FormatOption,
    OutputOption,
    RunOption,
    WideOption,
    with_default,
)
from msgflow.files.default_files import DEFAULT_DATABASE

app = typer.Typer(cls=with_default("show"))


@app.command("apply")
def apply(
    how: Annotated[
        str,
        typer.Argument(
            metavar="none|messages|FILE",
            help="As recorded, by the messages between hosts (and the network packets of their"
            " kernel traces), or by the offsets in a YAML or TOML file",
        ),
    ],
    run: RunOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Correct the clocks of a run, replacing any earlier correction; reads no trace."""
    from msgflow.cli.output import print_note, print_runs, print_status
    from msgflow.database import Database

    with Database(database) as opened:
        runs = opened.apply_clocks(how, run=run)
        print_runs(runs)
        for one in runs:
            clocks = opened.query("clocks", run=one.run_id).to_arrow().to_pylist()
            corrected = [clock for clock in clocks if clock["method"] not in ("none", "reference")]
            print_status(f"{len(corrected)} of {len(clocks)} clocks corrected: msgflow clocks show")
            pairs = opened.query("clocks-pair", run=one.run_id).to_arrow().to_pylist()
            if how == "messages" and pairs:
                messages = sum(pair["message_count"] for pair in pairs)
                packets = sum(pair["packet_count"] for pair in pairs)
                print_status(
                    f"by {messages:,} messages and {packets:,} network packets:"
                    " msgflow clocks pairs"
                )
            findings = opened.query(
                "info-findings", run=one.run_id, where="starts_with(name, 'clock_')"
            )
            for finding in findings.to_arrow().to_pylist():
                print_note(f"{finding['name']}: {finding['detail']}")


@app.command("show")
def show(
    run: RunOption = None,
    form: FormatOption = None,
    wide: WideOption = False,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """List the clocks and their corrections (the query clocks), and say whether times compare."""
    from msgflow.cli.output import print_result, print_status
    from msgflow.database import Database

    with Database(database) as opened:
        result = opened.query("clocks", run=run)
        verdicts = opened.clock_verdicts(run=run)
    print_result(result, form, output, wide=wide)
    for verdict in verdicts:
        print_status(verdict)


@app.command("pairs")
def pairs(
    run: RunOption = None,
    form: FormatOption = None,
    wide: WideOption = False,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Count the messages and packets that clocks are corrected by (the query clocks --by pair)."""
    from msgflow.cli.output import print_result
    from msgflow.database import Database

    with Database(database) as opened:
        result = opened.query("clocks-pair", run=run)
    print_result(result, form, output, wide=wide)
