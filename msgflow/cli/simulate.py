"""`msgflow simulate`: a trace of a ROS 2 system that never ran."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO", help="Name of the system", autocompletion=lambda: _scenarios()
        ),
    ],
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Where to write the trace")],
    factor: Annotated[
        float, typer.Option("--factor", min=0, help="Length, as a multiple of the scenario's own")
    ] = 1,
    seed: Annotated[int, typer.Option("--seed", help="Of the random numbers")] = 0,
) -> None:
    """Write the trace of a simulated ROS 2 system, and the links that really happened."""
    from msgflow.cli.output import count, print_status
    from msgflow.sim import simulate

    done = simulate(scenario, directory, factor=factor, seed=seed)
    traces = count(len(done.trace_directories), "trace")
    print_status(f"{traces}, {count(done.event_count, 'event')} written to {directory}")


def _scenarios() -> list[str]:
    from msgflow.sim import scenarios

    return list(scenarios())
