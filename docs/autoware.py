"""Writes the tables of `autoware.md`: `python docs/autoware.py`, some minutes.

It simulates the reference system with the second host started later by some delays, and with two
threads where point clouds are fused. Numbers of messages are also compared with the truth.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgflow
from msgflow_sim import simulate
from msgflow_sim.scenario.autoware import autoware, autoware_two_threads

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))
from support.autoware import measure, true_messages  # noqa: E402

MILLISECOND = 1_000_000
_DELAYS_MS = (0, 20, 50, 90)
_MARGIN_NS = 2_000_000_000
_PAPER = "| paper | 3 | 370 ms | 571 ms | |"


def main() -> None:
    """Write both tables between their marks."""
    page = HERE / "autoware.md"
    with tempfile.TemporaryDirectory() as place:
        tables = {"phases": _phases(Path(place)), "threads": _threads(Path(place))}
    text = page.read_text(encoding="utf-8")
    for name, lines in tables.items():
        mark = re.compile(rf"(<!-- {name}: .*-->\n\n).*?(?=\n\n)", re.DOTALL)
        text, count = mark.subn(lambda found, lines=lines: found[1] + "\n".join(lines), text)
        assert count == 1, name
    page.write_text(text, encoding="utf-8")


def _phases(place: Path) -> list[str]:
    lines = [
        "| second host later by | messages: 1 / 2 / 3 / 4 | first, median | last, median |"
        " if caches were emptied: 1 / 2 / 3 |",
        "| --- | --- | --- | --- | --- |",
    ]
    for delay_ms in _DELAYS_MS:
        scenario = autoware()
        last = scenario.hosts[-1].hostname
        processes = (
            replace(each, start_ns=each.start_ns + delay_ms * MILLISECOND)
            if each.hostname == last
            else each
            for each in scenario.processes
        )
        # The first run is the one that is compared.
        database, simulation, run = _run(
            place, f"later{delay_ms}", replace(scenario, processes=tuple(processes))
        )
        with database:
            (found,) = measure(database, [run], _MARGIN_NS)
        truth = true_messages(simulation.truth, found)
        assert truth[True] == (found.roots, found.messages)
        counts, emptied = (
            " / ".join(str(numbers.get(each, 0)) for each in range(1, most + 1))
            for numbers, most in ((found.messages, 4), (truth[False][1], 3))
        )
        times = " | ".join(
            f"{each[1] / MILLISECOND:.1f} ms" for each in (found.first_ns, found.last_ns)
        )
        lines.append(f"| {delay_ms} ms | {counts} | {times} | {emptied} |")
    return [*lines, _PAPER]


def _threads(place: Path) -> list[str]:
    database, _, _ = _run(place, "later0", None)
    with database:
        simulation = simulate(autoware_two_threads(), place / "two")
        database.ingest(simulation.directory, name="two")
        comparison = database.compare(
            "later0", "two", from_="/FrontLidarDriver", to="/VehicleInterface", skip_first=2
        )
    rows = comparison.result.to_arrow().to_pylist()
    return [
        "| last input of `/BehaviorPlanner` | one thread | two threads | difference, 95 % |"
        " verdict |",
        "| --- | --- | --- | --- | --- |",
        *_branches(row for row in rows if row["statistic"] == "mean"),
    ]


def _branches(rows: Iterable[dict[str, Any]]) -> list[str]:
    lines = {}
    for row in rows:
        steps = row["subject"].split(" → ")
        branch = steps[steps.index("/BehaviorPlanner") - 1]
        a, b, difference, low, high = (
            f"{row[name] / MILLISECOND:.1f}"
            for name in ("a_ns", "b_ns", "difference_ns", "low_ns", "high_ns")
        )
        change = f"{difference} ms ({low} to {high})"
        cells = (f"`{branch}`", f"{a} ms", f"{b} ms", change, row["verdict"])
        # Paths that differ behind /BehaviorPlanner alone are alike.
        lines.setdefault(branch, f"| {' | '.join(cells)} |")
    return list(lines.values())


def _run(place: Path, name: str, scenario: Any) -> tuple[msgflow.Database, Any, int]:
    database = msgflow.open_db(place / f"{name}.duckdb")
    if scenario is None:
        return database, None, 1
    simulation = simulate(scenario, place / name)
    return database, simulation, database.ingest(simulation.directory, name=name).run_id


if __name__ == "__main__":
    main()
