"""Whether `msgflow why` names the culprit of a problem that was planted in a robot.

    python benchmarks/planted.py [--python PYTHON] [--only PROBLEM]… [--to DIR]

A robot of ten nodes in eight processes (`robot/`) is recorded for ten seconds, from its start, with
one problem at a time, with two at once, and with none. `why` is asked without a topic. Its first
sentence has to name who is to blame, for what, and a number that is true; with two problems, the
first two sentences, the worse one first; with none, that nothing stands out. What is to blame
besides is printed. The robot is simulated, with the events of rclcpp, with and without those of the
kernel. With PYTHON, which has the wheels of ROS 2 (`make planted` installs them), the same robot
runs on this machine, too, with nodes of rclpy. Without the events of the kernel a process that
takes the CPU cannot be named: the sentence has to name who suffers, and what would show it. The
exit code is 1 if a sentence is missing.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot.problems import PAIRS, PROBLEMS, Problem
from robot.simulated import robot

from msgflow import Database
from msgflow.ingest import ingest
from msgflow_sim import simulate

if TYPE_CHECKING:
    Row = dict[str, Any]

_SECONDS = 10


def main() -> None:
    """Record, ask and compare."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", type=Path, help="Python with rclpy: run the robot, too")
    parser.add_argument("--only", action="append", help="problems, with + between; all when none")
    parser.add_argument(
        "--to",
        type=Path,
        default=Path("build/planted"),
        help="directory for a folder of each recording, which replaces that of an earlier run",
    )
    arguments = parser.parse_args()
    planted = [tuple(one.split("+")) for one in arguments.only or ()]
    bad = 0
    for names in planted or [("healthy",), *((name,) for name in PROBLEMS), *PAIRS]:
        problems = [name for name in names if name != "healthy"]
        directory = arguments.to.resolve() / "+".join(names)
        for system, has_kernel, database in _recorded(problems, directory, arguments.python):
            with Database(database) as opened:
                verdict = opened.why().verdict.table.to_pylist()
            missing = list(missed(problems, verdict, has_kernel=has_kernel))
            bad += bool(missing)
            print(f"{'MISSED' if missing else 'named':6}  {system:17} {' and '.join(names)}")
            for row in verdict:
                lines = textwrap.wrap(row["sentence"], 92)
                print(textwrap.indent("\n".join(lines), " " * 8), flush=True)
    print(f"{bad} of the answers do not name what was planted")
    sys.exit(1 if bad else 0)


def _recorded(
    problems: Sequence[str], directory: Path, python: Path | None
) -> Iterator[tuple[str, bool, Path]]:
    """Yield how it was recorded, whether with the kernel, and the database."""
    if directory.exists():
        shutil.rmtree(directory)
    simulate(robot(problems), directory / "simulated")
    simulated = directory / "simulated" / "robot"
    traces = [("rclcpp and kernel", True, simulated), ("rclcpp", False, simulated / "ust")]
    if python is not None:
        from recording.recorder import record_robot

        traces.append(("rclpy", False, record_robot(python, problems, _SECONDS, directory)))
    for system, has_kernel, trace in traces:
        database = directory / f"{system}.duckdb"
        ingest([trace], database)
        yield system, has_kernel, database


def missed(problems: Sequence[str], verdict: Sequence[Row], *, has_kernel: bool) -> Iterator[str]:
    """Yield the problems that a verdict does not name at their place."""
    # What is wrong with the recording costs nothing.
    told = [row for row in verdict if row["cost_ns"] is not None]
    if not problems and (told or "nothing stands out" not in verdict[-1]["sentence"]):
        yield "that nothing stands out"
    for place, name in enumerate(problems):
        if place >= len(told) or not is_named(PROBLEMS[name], told[place], has_kernel=has_kernel):
            yield name


def is_named(problem: Problem, row: Row, *, has_kernel: bool) -> bool:
    """Whether a sentence says who is to blame for a problem, for what, and a true number."""
    if problem.without_kernel is not None and not has_kernel:
        return (
            row["who"] == problem.without_kernel
            and re.search(r"for [\d.]+ ms .*not known without a kernel trace", row["sentence"])
            is not None
        )
    said = re.search(problem.sentence, row["sentence"])
    return (
        problem.kind in row["kinds"]
        and re.fullmatch(rf"{problem.culprit}( \(\d+\))?", row["who"]) is not None
        and said is not None
        and problem.least <= float(said[1]) <= problem.most
    )


if __name__ == "__main__":
    main()
