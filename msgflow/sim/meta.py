"""The summary beside the truth tables: what was simulated and how much of everything there is."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from msgflow.sim.machine import Machine
    from msgflow.sim.system import Scenario
    from msgflow.sim.truth import Truth


def write_meta(
    path: Path,
    scenario: Scenario,
    arguments: Mapping[str, object],
    machines: Mapping[str, Machine],
    truth: Truth,
    outcome: Mapping[str, object],
) -> None:
    """Write `meta.json`; see the docstring of `msgflow.sim`."""
    content = {
        "scenario": scenario.name,
        "description": scenario.description,
        "layout": scenario.layout,
        **arguments,
        "hosts": {
            name: {
                "traces": [
                    str(directory.relative_to(path.parent.parent))
                    for directory in machine.recorder.directories
                ],
                "begin_of_tracing_ns": 0 + machine.epoch,
                "clock_drift_ppb": machine.epoch.drift_ppb,
                "cpu_count": machine.recorder.cpu_count,
                "events": dict(machine.tracepoints.counts()),
            }
            for name, machine in machines.items()
        },
        "processes": [
            {
                "host": process.hostname,
                "pid": process.pid,
                "name": process.name,
                "nodes": [node.full_name for node in process.nodes],
            }
            for process in scenario.processes
        ],
        "rows": {name: table.count for name, table in truth.tables.items()},
        **outcome,
    }
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
