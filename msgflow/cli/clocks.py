"""Synchronise the clocks of several hosts; without a command: show."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import typer

from msgflow.cli.operation import operation
from msgflow.cli.output import print_note, print_runs, print_status
from msgflow.cli.query_command import AskingGroup, print_rows
from msgflow.database import Database

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult


class _ClocksGroup(AskingGroup):
    default = "show"

    def write(self, result: QueryResult, form: Any, given: dict[str, Any]) -> None:
        print_rows(result, form, given)
        if given["own_by"] != "pair":
            with Database(given["database"]) as opened:
                verdicts = opened.clock_verdicts(run=given["run"])
            for verdict in verdicts:
                print_status(verdict)


app = typer.Typer(cls=_ClocksGroup)


@app.command("apply")
@operation
def apply(database: Database, how: str, *, run: str | None = None) -> None:
    """Correct the clocks of a run, replacing any earlier correction; reads no trace.

    Args:
        how (none|messages|FILE): As recorded, by the messages between hosts (and the network
            packets of their kernel traces), or by the offsets in a YAML or TOML file.
    """
    runs = database.apply_clocks(how, run=run)
    print_runs(runs)
    for one in runs:
        ask = partial(database.query, run=one.run_id)
        clocks = ask("clocks").to_arrow().to_pylist()
        corrected = [clock for clock in clocks if clock["method"] not in ("none", "reference")]
        print_status(f"{len(corrected)} of {len(clocks)} clocks corrected: msgflow clocks")
        pairs = ask("clocks-pair").to_arrow().to_pylist()
        if how == "messages" and pairs:
            messages = sum(pair["message_count"] for pair in pairs)
            packets = sum(pair["packet_count"] for pair in pairs)
            print_status(
                f"by {messages:,} messages and {packets:,} network packets:"
                " msgflow clocks --by pair"
            )
        findings = ask("info-findings", where="starts_with(name, 'clock_')")
        for finding in findings.to_arrow().to_pylist():
            print_note(f"{finding['name']}: {finding['detail']}")
