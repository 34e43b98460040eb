"""The Autoware reference system on two simulated hosts: one lidar message, end to end.

    python benchmarks/autoware.py                  # the numbers of docs/autoware.md, some minutes
    python benchmarks/autoware.py --phases 1 --seconds 5

Simulates the scenarios `autoware` and `autoware_two_threads` as they are and with the second host
started later in steps, so that its timers have other phases; ingests all traces; prints what one
/FrontLidarDriver message becomes at /VehicleDBWSystem, checks that against the truth of the
simulation, and compares the two. The exit code is 1 if the database differs from the truth.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb

import msgflow
from msgflow.sim import scenarios, simulate
from msgflow.sim.entity import MILLISECOND, SECOND

if TYPE_CHECKING:
    from collections.abc import Mapping

    from msgflow.sim import Scenario

NAMES = ("autoware", "autoware_two_threads")
_HERE = Path(__file__).parent
_CYCLE_MS = 100
_MARGIN_NS = 2 * SECOND
_STATISTICS = ("median", "mean")


@dataclass(frozen=True)
class Measured:
    """What became of the messages of one run; `usual_branches` are the topics by which each of
    the messages came to /BehaviorPlanner, in order, where their number is the usual one."""

    name: str
    from_ns: int
    until_ns: int
    roots: int
    messages: Mapping[int, int]
    first_ns: tuple[int, int, int]
    last_ns: tuple[int, int, int]
    usual_branches: str


def later(scenario: Scenario, delay_ms: int) -> Scenario:
    """The scenario with all processes of the second host started later."""
    second = scenario.hosts[1].hostname
    return replace(
        scenario,
        processes=tuple(
            replace(each, start_ns=each.start_ns + delay_ms * MILLISECOND)
            if each.hostname == second
            else each
            for each in scenario.processes
        ),
    )


def measure(database: msgflow.Database, run_ids: list[int], margin_ns: int) -> list[Measured]:
    """What the database says about runs."""
    rows = database.connection.execute(
        (_HERE / "autoware.sql").read_text(), {"runs": run_ids, "margin_ns": margin_ns}
    ).fetchall()
    return [Measured(*row) for row in rows]


def true_messages(truth: Mapping[str, Path], measured: Measured) -> dict[bool, tuple[int, Any]]:
    """How many messages arrived really: roots and counts, with and without what was used again."""
    with duckdb.connect() as connection:
        for name, path in truth.items():
            connection.execute(f"CREATE VIEW {name} AS FROM '{path}'")
        rows = connection.execute(
            (_HERE / "autoware_truth.sql").read_text(),
            {"from_ns": measured.from_ns, "until_ns": measured.until_ns},
        ).fetchall()
    return {is_reusing: (roots, messages) for is_reusing, roots, messages in rows}


def main() -> int:
    """Run it all."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--phases", type=int, default=10, help="starts of the second host")
    parser.add_argument("--seconds", type=float, default=20, help="length of each run")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    is_right = True
    with (
        tempfile.TemporaryDirectory(prefix="msgflow-autoware-") as directory,
        msgflow.open_db(Path(directory) / "autoware.duckdb") as database,
    ):
        runs: dict[tuple[str, int], int] = {}
        truths = {}
        for phase in range(options.phases):
            delay_ms = phase * _CYCLE_MS // options.phases
            for name in NAMES:
                scenario = later(scenarios()[name], delay_ms)
                simulation = simulate(
                    scenario,
                    Path(directory) / f"{name}-{delay_ms}",
                    factor=options.seconds * SECOND / scenario.duration_ns,
                    seed=options.seed,
                )
                report = database.ingest(simulation.directory, name=f"{name} +{delay_ms} ms")
                runs[name, delay_ms] = report.run_id
                truths[report.run_id] = simulation.truth
        for name in NAMES:
            run_ids = [run_id for (each, _), run_id in runs.items() if each == name]
            for run_id, measured in zip(
                run_ids, measure(database, run_ids, _MARGIN_NS), strict=True
            ):
                is_right &= _report(measured, true_messages(truths[run_id], measured))
        for delay_ms in sorted({delay_ms for _, delay_ms in runs}):
            one, other = (runs[name, delay_ms] for name in NAMES)
            _compare(database, one, other, delay_ms)
    return 0 if is_right else 1


def _report(measured: Measured, truth: dict[bool, tuple[int, Any]]) -> bool:
    first, last = (
        " / ".join(f"{value / 1e6:.1f}" for value in values)
        for values in (measured.first_ns, measured.last_ns)
    )
    is_right = truth[True] == (measured.roots, measured.messages)
    print(f"{measured.name}: {measured.roots} roots, messages {dict(measured.messages)}")
    print(f"  first {first} ms, last {last} ms (least / median / most)")
    print(f"  usually by {measured.usual_branches}")
    print(f"  {'as in truth' if is_right else f'TRUTH IS {truth[True]}'}", end="; ")
    print(f"if caches were emptied: {dict(truth[False][1])}")
    return is_right


def _compare(database: msgflow.Database, run_a: int, run_b: int, delay_ms: int) -> None:
    comparison = database.compare(
        run_a, run_b, from_="/FrontLidarDriver", to="/VehicleInterface", skip_first=2
    )
    print(f"two threads against one, second host {delay_ms} ms later")
    for row in comparison.result.to_arrow().to_pylist():
        # Each message comes by way of both /MPCController and /BehaviorPlanner, at the same time.
        if row["statistic"] not in _STATISTICS or "/MPCController" not in row["subject"]:
            continue
        ends = [row[name] for name in ("difference_ns", "low_ns", "high_ns")]
        ms = ["NA" if value is None else f"{value / 1e6:.2f}" for value in ends]
        topics = row["subject"].split(" → ")[1:-1:2]
        branch = topics[topics.index("/BehaviorPlanner") - 1]
        print(
            f"  {row['statistic']:6} {row['a_ns'] / 1e6:8.2f} {row['b_ns'] / 1e6:8.2f}"
            f" {ms[0]:>8} [{ms[1]}, {ms[2]}] ms, {row['verdict']},"
            f" delta {row['cliffs_delta']:.3f} {row['separation']}: {branch}"
        )


if __name__ == "__main__":
    sys.exit(main())
