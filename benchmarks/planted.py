"""Whether `msgflow why` names the culprit of a problem that was planted in a robot.

    python benchmarks/planted.py [--python PYTHON] [--only PATTERN]… [--to DIR]
                                 [--keep recordings|databases] [--archives DIR] [--seeds NUMBER]

Robots (`robot/`) run with one problem at a time, with two at once, and with none; `why` is asked
without a topic. Its first headline has to name who is to blame, with callback and function, the
kind of cause, and a number that is true; with two problems, the first two headlines, the worse one
first; with none, that nothing stands out. What is blamed besides is printed.

Robots are simulated, with the events of rclcpp: one of ten nodes (`simulated.py`), and twins of the
drone and the picker with names, periods and durations of ten seeds (`twins.py`). With PYTHON, which
has the wheels of ROS 2 (`make planted` installs them), robots run on this machine. They are
recorded one after the other, and nothing else should run meanwhile. Four of rclpy are recorded with
the kernel: that of ten nodes, the drone, the picker, and the vehicle.

The smallest robot, of rclpy (`worker.py`) and with the events of rclcpp (`c_worker.c`), is recorded
without the kernel: by CPU times and samples of the system alone it has to be known that its
callback computes, sleeps, waits for a lock or the disk, or has no CPU because of another program or
a quota of its cgroup. It measures its CPU times itself: those of the recording may differ by 50 µs
and 1 % in 99 % of the calls, of C++ by 10 µs more for each time that a callback waits.

What is recorded with the kernel is asked again without its events. Of the simulator nothing is left
then that tells what threads did: who waits for a lock, a disk, a CPU or the lock of the interpreter
has to be named, and for how long.

A name of a case is `drone-sometimes-1`, `vehicle-healthy-3` or, of the simulator,
`picker_rclcpp-burst-7`; PATTERN is of such names (`drone-*`). With `--keep`, recordings in DIR, or
the databases that were made of them, too, are asked again. Archives are other recordings of these
robots, `drone-sometimes.tar.xz`, or `k-picker-lock.tar.xz` with the kernel; then nothing else is
asked.

All first headlines stand in DIR/headlines.md. The exit code is 1 if something is missing.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import product
from pathlib import Path

from recording.quota import why_no_quota
from recording.recorder import QUOTA, record_launched
from robot.cpu_time import clock_offset_ns, in_words, measured_calls, wrong_times
from robot.judge import Culprit, Told, missed, told
from robot.problems import PAIRS, ROBOTS
from robot.simulated import robot
from robot.twins import PROBLEMS as TWIN_PROBLEMS
from robot.twins import twin

from msgflow import Database
from msgflow.ingest import ingest
from msgflow_sim import Scenario, simulate

_SECONDS = 12
_SEEDS = 10
_HEALTHY = 3
_WIDTH = 92
_SIMULATED = "_rclcpp"
_WITH_KERNEL, _WITHOUT, _ROS_ONLY = "with kernel", "without kernel", "ROS only"


@dataclass(frozen=True)
class Case:
    """A robot with what is planted in it.

    Attributes:
        system: the robot, with `_rclcpp` of the simulator.
        problems: what is planted, the worst first.
        number: the seed, or which one of equal recordings.
        archive: where it is recorded already.
    """

    system: str
    problems: tuple[str, ...]
    number: int = 1
    archive: Path | None = None

    @property
    def planted(self) -> str:
        """What is planted, in words."""
        return "+".join(self.problems) or "healthy"

    @property
    def name(self) -> str:
        """Its name, for a directory and for `--only`."""
        return f"{self.system}-{self.planted}-{self.number}"

    @property
    def robot(self) -> str:
        """Name of its robot."""
        return self.system.removesuffix(_SIMULATED)

    @property
    def has_kernel(self) -> bool:
        """Whether the kernel is recorded, too."""
        return not self.robot.endswith("worker")

    @property
    def is_simulated(self) -> bool:
        """Whether the simulator makes its recording."""
        return self.system.endswith(_SIMULATED)

    @property
    def is_twin(self) -> bool:
        """Whether a seed chooses its names."""
        return self.is_simulated and self.robot in TWIN_PROBLEMS

    @property
    def twin(self) -> tuple[Scenario, list[Culprit]]:
        """The scenario of its seed, and who is to blame."""
        return twin(self.robot, next(iter(self.problems), None), self.number)

    @property
    def culprits(self) -> list[Culprit]:
        """Who is to blame, the worst first."""
        if self.is_twin:
            return self.twin[1]
        return [ROBOTS[self.robot][name] for name in self.problems]


@dataclass(frozen=True)
class Answer:
    """What `why` says of a recording.

    Attributes:
        case: what was recorded.
        events: what was asked of it.
        verdict: what it says.
        missing: what is missing in that, or wrong.
        cpu_seconds: the CPU that it took.
        cpu_times: how many CPU times of callbacks are right, in words.
    """

    case: Case
    events: str
    verdict: list[Told]
    missing: list[str]
    cpu_seconds: float
    cpu_times: str = ""

    @property
    def headline(self) -> str:
        """The first sentence: that of the worst culprit, before notes."""
        return (self.accused or self.verdict)[0].headline

    @property
    def accused(self) -> list[Told]:
        """Rows that are no notes."""
        return [row for row in self.verdict if row.has_harm]

    @property
    def besides(self) -> list[str]:
        """Who is accused after as many culprits as were planted."""
        later = self.accused[len(self.case.problems) :]
        return [f"{row.who} ({row.kind})" for row in later]


def main() -> None:
    """Record, ask and compare."""
    arguments = _arguments()
    to = arguments.to.resolve()
    # Robots run elsewhere. The link of an environment is not followed: it would be left.
    python = arguments.python and arguments.python.absolute()
    if arguments.archives is None:
        cases = list(_cases(arguments.seeds, has_rclpy=arguments.python is not None))
    else:
        cases = list(_archives(arguments.archives))
    patterns = arguments.only or ["*"]
    cases = [case for case in cases if any(fnmatchcase(case.name, one) for one in patterns)]
    if not arguments.keep and (reason := why_no_quota()) is not None:
        print(f"left out, as no process can have a quota here: {reason}")
        cases = [case for case in cases if QUOTA not in case.problems]
    failed = [
        case
        for case in cases
        if not _is_recorded(case, to / case.name, python, keep=arguments.keep is not None)
    ]
    cases = [case for case in cases if case not in failed]
    answers: list[Answer] = []
    with ProcessPoolExecutor() as pool:
        asked = [pool.submit(answer, case, to / case.name, arguments.keep) for case in cases]
        for one in asked:
            for each in one.result():
                answers.append(each)
                _show(each)
    table = to / "headlines.md"
    table.write_text(headlines(answers))
    bad = sum(bool(each.missing) for each in answers) + len(failed)
    slowest = max((each.cpu_seconds for each in answers), default=0)
    print(f"{bad} of {len(answers) + len(failed)} answers do not name what was planted — {table}")
    print(f"an answer took up to {slowest:.1f} s of CPU")
    sys.exit(1 if bad else 0)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", type=Path, help="Python with rclpy: run robots, too")
    parser.add_argument("--only", action="append", help="patterns of names; all when none")
    parser.add_argument(
        "--to",
        type=Path,
        default=Path("build/planted"),
        help="directory for a folder of each case, which replaces that of an earlier run",
    )
    parser.add_argument(
        "--keep", choices=("recordings", "databases"), help="what of an earlier run is asked again"
    )
    parser.add_argument("--archives", type=Path, help="directory of other recordings")
    parser.add_argument("--seeds", type=int, default=_SEEDS, help="twins of each problem")
    return parser.parse_args()


def _cases(seeds: int, *, has_rclpy: bool) -> Iterator[Case]:
    for problems in ((), *((name,) for name in ROBOTS["robot"]), *PAIRS["robot"]):
        yield Case(f"robot{_SIMULATED}", problems)
    for name, planted in TWIN_PROBLEMS.items():
        for problem, seed in product((None, *planted), range(1, seeds + 1)):
            yield Case(f"{name}{_SIMULATED}", (problem,) if problem else (), seed)
    if not has_rclpy:
        return
    for name, culprits in ROBOTS.items():
        for number in range(1, _HEALTHY + 1):
            yield Case(name, (), number)
        for problems in (*((problem,) for problem in culprits), *PAIRS[name]):
            yield Case(name, problems)


def _archives(directory: Path) -> Iterator[Case]:
    for archive in sorted(directory.glob("*.tar.xz")):
        name, _, planted = archive.name.removesuffix(".tar.xz").removeprefix("k-").partition("-")
        problems = () if planted == "healthy" else tuple(planted.split("+"))
        yield Case(name, problems, archive=archive)


def _is_recorded(case: Case, directory: Path, python: Path, *, keep: bool) -> bool:
    """Record a robot of rclpy, unless its recording is kept; tell whether there is one."""
    has_recording = keep and (directory / "trace" / "ust").is_dir()
    if case.is_simulated or case.archive is not None or has_recording:
        return True
    begin = time.monotonic()
    _empty(directory)
    try:
        record_launched(
            python, case.robot, case.problems, _SECONDS, directory, with_kernel=case.has_kernel
        )
    except subprocess.SubprocessError as error:
        print(f"NOT RECORDED {case.name}: {error}", flush=True)
        return False
    print(f"recorded {case.name} in {time.monotonic() - begin:.0f} s", flush=True)
    return True


def answer(case: Case, directory: Path, keep: str | None) -> list[Answer]:
    """Ask why of a recording, with the events of the kernel if it has them, and without."""
    trace = directory / "trace"
    if case.is_simulated and not (keep and trace.is_dir()):
        _empty(directory)
        scenario = case.twin[0] if case.is_twin else robot(case.problems)
        simulate(scenario, trace, seed=case.number)
    if case.archive is not None:
        is_with_kernel = case.archive.name.startswith("k-")
        traces = {_WITH_KERNEL if is_with_kernel else _ROS_ONLY: case.archive}
    elif case.is_simulated:
        traces = {_WITH_KERNEL: trace / "robot", _ROS_ONLY: trace / "robot" / "ust"}
    elif case.has_kernel:
        traces = {_WITH_KERNEL: trace, _WITHOUT: _without_kernel(trace)}
    else:
        traces = {_WITHOUT: trace}
    return [_asked(case, directory, keep, *one) for one in traces.items()]


def _without_kernel(recording: Path) -> Path:
    """Return a directory with the same recording, but for the trace of the kernel."""
    directory = recording.with_name("without_kernel")
    _empty(directory)
    for each in recording.iterdir():
        if each.name not in ("kernel", "perf"):
            (directory / each.name).symlink_to(each)
    return directory


def _asked(case: Case, directory: Path, keep: str | None, events: str, trace: Path) -> Answer:
    directory.mkdir(parents=True, exist_ok=True)
    database = directory / f"{events.replace(' ', '_')}.duckdb"
    if keep != "databases" or not database.exists():
        database.unlink(missing_ok=True)
        ingest([trace], database)
    with Database(database) as opened:
        begin = time.process_time()
        verdict = told(opened.why().verdict.table.to_pylist())
        cpu_seconds = time.process_time() - begin
    missing = list(missed(case.culprits, verdict, knows_cpu=events != _ROS_ONLY))
    cpu_times = ""
    if (truth := directory / "truth.tsv").exists():
        calls = measured_calls(database, truth, clock_offset_ns(trace / "ust"))
        missing += wrong_times(calls)
        cpu_times = in_words(calls)
    return Answer(case, events, verdict, missing, cpu_seconds, cpu_times)


def _empty(directory: Path) -> None:
    if directory.exists():
        shutil.rmtree(directory)
    directory.mkdir(parents=True)


def _show(given: Answer) -> None:
    print(f"{'MISSED' if given.missing else 'named':6}  {given.case.name}, {given.events}")
    for fault in given.missing:
        print(f"    {fault}")
    if given.cpu_times:
        print(f"    {given.cpu_times}")
    for row in given.verdict:
        lines = textwrap.wrap(row.headline, _WIDTH)
        print(textwrap.indent("\n".join(lines), " " * 8), flush=True)


def headlines(answers: Sequence[Answer]) -> str:
    """Return a table of first headlines, in Markdown."""
    rows: list[tuple[str, ...]] = [
        ("system", "planted", "recorded", "first headline", "missed", "besides", "CPU times"),
        ("-",) * 7,
    ]
    for each in answers:
        missing, besides = "; ".join(each.missing), ", ".join(each.besides)
        words = (each.case.system, each.case.planted, each.events, each.headline, missing, besides)
        rows.append(tuple(word.replace("|", "/") for word in (*words, each.cpu_times)))
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


if __name__ == "__main__":
    main()
