"""`msgflow simulate`: a trace of a ROS 2 system that never ran."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def command(
    scenario: Annotated[str, typer.Argument(metavar="SCENARIO", help="Name of the system")],
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Where to write the trace")],
    factor: Annotated[
        float, typer.Option("--factor", min=0, help="Length, as a multiple of the scenario's own")
    ] = 1,
    seed: Annotated[int, typer.Option("--seed", help="Of the random numbers")] = 0,
) -> None:
    """Write the trace of a simulated ROS 2 system, and the links that really happened."""
    from msgflow.cli.output import print_status
    from msgflow.sim import simulate

    simulate(scenario, directory, factor=factor, seed=seed)
    print_status(f"trace of {scenario} written to {directory}")
