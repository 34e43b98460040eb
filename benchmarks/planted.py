"""Whether `msgflow why` names the culprit of a problem that was planted in a robot.

    python benchmarks/planted.py [--python PYTHON] [--kernel] [--only PROBLEM]… [--to DIR]

A robot of ten nodes in eight processes (`robot/`) is recorded for ten seconds, from its start, with
one problem at a time, with two at once, and with none. `why` is asked without a topic. Its first
sentence has to name who is to blame, and for what; with two problems, the first two sentences; with
none, that nothing stands out. The robot is simulated, with the events of rclcpp and of the kernel.
With PYTHON, which has the wheels of ROS 2 (`make planted` installs them), the same robot runs on
this machine, too, with nodes of rclpy; --kernel records the kernel beside it. The exit code is 1 if
a sentence is missing.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow_sim import simulate
from robot.problems import PAIRS, PROBLEMS
from robot.simulated import robot

from msgflow import Database
from msgflow.ingest import ingest

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence


@dataclass(frozen=True)
class Answer:
    """What was said of a recording.

    Attributes:
        problems: that were planted.
        first: the sentence.
        missing: what was to be named, and was not.
    """

    problems: Sequence[str]
    first: str
    missing: tuple[str, ...]


def main() -> None:
    """Record, ask and compare."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", type=Path, help="Python with rclpy: run the robot, too")
    parser.add_argument("--kernel", action="store_true", help="record the kernel beside rclpy")
    parser.add_argument("--only", action="append", help="problems, with + between; all when none")
    parser.add_argument(
        "--to", type=Path, default=Path("build/planted"),
        help="directory for a folder of each recording, which replaces that of an earlier run",
    )  # fmt: skip
    arguments = parser.parse_args()
    planted = [tuple(one.split("+")) for one in arguments.only or ()]
    planted = planted or [(), *((name,) for name in PROBLEMS), *PAIRS]
    bad = 0
    for problems in planted:
        for system, answer in _answers(problems, arguments):
            bad += bool(answer.missing)
            print(f"{'MISSED' if answer.missing else 'named'}  {system:17} ", end="")
            print(" and ".join(problems) or "healthy", end="")
            print(f": {', '.join(answer.missing)}" if answer.missing else "")
            print(textwrap.indent(textwrap.fill(answer.first, 92), " " * 8), flush=True)
    print(f"{bad} of the answers do not name what was planted")
    sys.exit(1 if bad else 0)


def _answers(
    problems: Sequence[str], arguments: argparse.Namespace
) -> Iterator[tuple[str, Answer]]:
    directory = arguments.to.resolve() / ("+".join(problems) or "healthy")
    if directory.exists():
        shutil.rmtree(directory)
    simulate(robot(problems), directory / "simulated")
    recorded = directory / "simulated" / "robot"
    yield "rclcpp and kernel", _asked(problems, recorded, directory / "kernel.duckdb")
    yield "rclcpp", _asked(problems, recorded / "ust", directory / "rclcpp.duckdb", has_kernel=False)
    if arguments.python is not None:
        from recording.recorder import record_robot

        recorded = record_robot(arguments.python, problems, directory, arguments.kernel)
        yield "rclpy", _asked(
            problems, recorded, directory / "rclpy.duckdb", has_kernel=arguments.kernel
        )


def _asked(
    problems: Sequence[str], recorded: Path, path: Path, *, has_kernel: bool = True
) -> Answer:
    ingest([recorded], path)
    with Database(path) as database:
        told = [row for row in database.why().verdict.table.to_pylist() if row["cost_ns"] or not row["who"]]
    missing = []
    for name, row in zip(problems, [*told, *[None] * len(problems)], strict=False):
        problem = PROBLEMS[name]
        if problem.needs_kernel and not has_kernel:
            if row is None or "not known without a kernel trace" not in row["sentence"]:
                missing.append(f"how to know of {name}")
        elif row is None or problem.kind not in row["kinds"] or not row["who"].startswith(problem.culprit):
            missing.append(name)
    if not problems and told[0]["who"] is not None:
        missing.append("that nothing stands out")
    return Answer(problems, "\n".join(row["sentence"] for row in told), tuple(missing))


if __name__ == "__main__":
    main()
