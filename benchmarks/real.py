"""Precision and recall of what msgflow finds in real ROS 2, recorded here and now.

    python benchmarks/real.py --python PYTHON [--system NAME]… [--seconds 5] [--keep DIR]

Nodes of rclpy run in processes of their own, and LTTng records them. They write down what they send
and in which callback. The trace is ingested and compared with that, as `truth.py` does. PYTHON has
the wheels of ROS 2 (`make real` installs them). The exit code is 1 if a figure is not what it must
be.
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


def main() -> None:
    """Record, ingest and compare each system."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", type=Path, required=True, help="Python with rclpy")
    parser.add_argument("--system", action="append", help="one of the systems; all when none")
    parser.add_argument("--seconds", type=float, default=5, help="how long each runs")
    parser.add_argument("--keep", type=Path, help="directory to keep traces and truths in")
    arguments = parser.parse_args()
    judged: list[Judged] = []
    try:
        require(arguments.python)
        for system in arguments.system or systems(arguments.python):
            judged += show(_judged(arguments.python, system, arguments.seconds, arguments.keep))
    except NotPossibleError as error:
        sys.exit(f"cannot record: {error}")
    bad = [one for one in judged if not one.is_good]
    print(f"\n{len(judged)} figures, {len(bad)} of them not what they must be")
    sys.exit(1 if bad else 0)


def _judged(python: Path, system: str, seconds: float, keep: Path | None) -> list[Judged]:
    with tempfile.TemporaryDirectory() as temporary:
        directory = Path(temporary) / system
        trace, truth = record(python, system, seconds, directory)
        if keep is not None:
            shutil.copytree(trace, keep / system / "trace")
            shutil.copy(truth, keep / system)
        database = Path(temporary) / "run.duckdb"
        ingest([trace], database)
        return [Judged(system, "rclpy", "recorded", one) for one in compare_real(database, truth)]


if __name__ == "__main__":
    main()
