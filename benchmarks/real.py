"""Precision and recall of what msgflow finds in real ROS 2, recorded here and now.

    python benchmarks/real.py --python PYTHON [--system NAME]… [--seconds 5] [--to DIR]
        [--python-nodes]

Nodes of rclpy run in processes of their own, and LTTng records them. They write down what they send
and in which callback. The trace is ingested and compared with that, as `truth.py` does. PYTHON has
the wheels of ROS 2 (`make real` installs them). Traces and truths stay in DIR until the next run: a
recording cannot be repeated. The exit code is 1 if a figure is not what it must be.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

from recording.recorder import NotPossibleError, record, require, systems
from scoring import compare_real
from truth import Judged, show

from msgflow.ingest import ingest

# Executors in C++, which call what a node has without any Python between. The tracer sees nothing.
UNTRACED = {"events"}


def main() -> None:
    """Record, ingest and compare each system."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", type=Path, required=True, help="Python with rclpy")
    parser.add_argument("--system", action="append", help="one of the systems; all when none")
    parser.add_argument("--seconds", type=float, default=5, help="how long each runs")
    parser.add_argument(
        "--to",
        type=Path,
        default=Path("build/real"),
        help="directory for a folder of each system, which replaces that of an earlier run",
    )
    parser.add_argument(
        "--python-nodes", action="store_true", help="trace callbacks and executors of rclpy, too"
    )
    arguments = parser.parse_args()
    judged: list[Judged] = []
    try:
        require(arguments.python)
        known = systems(arguments.python)
        traced = known.keys() - (UNTRACED if arguments.python_nodes else set())
        for system in arguments.system or (name for name in known if name in traced):
            directory = arguments.to.resolve() / system
            judged += show(_judged(arguments, system, directory))
    except NotPossibleError as error:
        sys.exit(f"cannot record: {error}")
    bad = [one for one in judged if not one.is_good]
    print(f"\n{len(judged)} figures, {len(bad)} of them not what they must be")
    print(f"recorded in {arguments.to}")
    sys.exit(1 if bad else 0)


def _judged(arguments: argparse.Namespace, system: str, directory: Path) -> list[Judged]:
    if directory.exists():
        shutil.rmtree(directory)
    trace, truth = record(
        arguments.python,
        system,
        arguments.seconds,
        directory,
        python_nodes=arguments.python_nodes,
    )
    with tempfile.TemporaryDirectory() as temporary:
        database = Path(temporary) / "run.duckdb"
        ingest([trace], database)
        return [Judged(system, "rclpy", "recorded", one) for one in compare_real(database, truth)]


if __name__ == "__main__":
    main()
