"""Precision and recall of what msgflow finds, where what happened is known.

    python benchmarks/truth.py [--sample DAY] [--all] [--quick]
        [--system NAME]… [--layout NAME]… [--recording NAME]… [--factor 0.1] [--seed 0]
        [--first SYSTEM] [--last SYSTEM] [--traces DIR] [--jobs N] [--csv FILE]

Simulates systems, in the layouts of the releases of ROS 2 and recorded with the faults that
recordings have, ingests the traces and compares the result with the truth, row by row, in SQL. The
recorded systems in ../shared/traces are compared likewise where that folder exists.

Each day has a sample of its own: three seeds for each system, each of them short and at full
length, in a layout and with a fault that are drawn. `--sample 20260131` repeats one. `--all` is
every layout and fault, at one length and with one seed; so is what is chosen by name.

For each kind of link: how many there were, how many of these the trace decides, how many rows were
found, wrong ones, and decided ones that are missing. Precision is the share of the rows that are
true, recall the share of the decided links that were found; both must be 1.000.

Then, for each message that a subscription did not take, the true reason beside the one given, and
where the trace does not decide it why not. The exit code is 1 if a figure that must be 1.000 is
not, or a reason is wrong that the trace decides. Of all systems, `--first` and `--last` choose a
part; the recorded ones come with the last. A short simulation may be over before its only snapshot:
then nothing is recorded, and the line says so. A line begins with `✗` where a figure is not what it
must be.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from pathlib import Path
from random import Random

from scoring import Drop, Score, compare_real, compare_recorded, compare_simulated

from msgflow.errors import TraceError
from msgflow.ingest import ingest
from msgflow_sim import (
    Buffers,
    Recording,
    Scenario,
    layouts,
    long_recording,
    scenarios,
    simulate,
)

SHARED_TRACES = Path(__file__).parents[1] / ".." / "shared" / "traces"
SECOND = 1_000_000_000
PERFECT = "perfect"
PERF = "perf"
OWN_EVENTS = ("my_pkg:*",)
LONG = "long_recording"
# Recall of the half an hour in which clocks drift apart by 36 ms; and of bursts that another host
# takes: where losses leave few publications, the clocks are known to a microsecond only.
LOWEST_RECALL = {LONG: 0.999, "bursts_two_hosts": 0.998}
# One message was published after the shutdown of ROS, and reached neither rcl nor the trace.
LOWEST_RECALL |= dict.fromkeys(
    ("real_container", "real_jazzy_container", "real_cache", "real_overload"), 0.998
)
# Likewise of recordings: around a step of the clock nothing is linked; two in a second may leave no
# time without one.
LOWEST_RECALL |= {"steps": 0, "clock_step": 0.98}
# One of 6,508 was stamped 13.7 ms after its write. A message written 9 ms later had been taken
# before, as if the clock had been set back.
LOWEST_RECALL |= {"shared_publisher": 0.9998}
# Several threads, or one in a burst, write to one topic within microseconds. If the publication of
# one message is lost, and the take of another, nothing in the trace tells. So a wrong link must at
# least be marked.
MOST_LOSS_AFFECTED = dict.fromkeys(("rivals", "bursts", "bursts_two_hosts"), 0.001)
# Recorded with losses: their truth says which events are missing, but not where others might be. A
# link over such a place is not decided, and a publication may be torn in two. Precision is judged.
LOSSY_RECORDINGS = {"intra_lost", "lossy_intra", "lossy_intra_mt"}
LOSSY_RECALL = 0.93

# So small that a second of a system fills some.
_SMALL = 4096
# What recordings do to a second of a system.
RECORDINGS = {
    PERFECT: Recording(),
    "late": Recording(start_ns=SECOND // 3),
    "loss": Recording(lost_event_share=0.3),
    "packets": Recording(lost_packet_share=0.2),
    "pause": Recording(pauses=((SECOND // 3, SECOND // 2),)),
    # Processes join and leave one after the other; also with messages on their way between them.
    "handover": Recording(
        start_ns=SECOND // 10, pauses=((SECOND // 6, SECOND // 5),), handover_ns=30_000_000
    ),
    "dual_handover": Recording(
        start_ns=SECOND // 10, is_dual_session=True, clock_error_ns=3_000, handover_ns=30_000_000
    ),
    # Events of initialisation, and later ones.
    "lost_begin": Recording(
        losses=((4_000_000, 6_000_000), (150_000_000, 170_000_000), (500_000_000, 540_000_000))
    ),
    "truncated": Recording(cut_streams=1, unfinished_streams=1),
    "dual": Recording(start_ns=SECOND // 3, is_dual_session=True, clock_error_ns=3_000),
    # The last one while the source of `stall` computes.
    "rotated": Recording(rotations=(SECOND // 3, SECOND // 2, SECOND * 4 // 3)),
    "chunk_missing": Recording(rotations=(SECOND // 3, SECOND // 2), missing_chunk=1),
    "brim": Recording(
        lost_event_share=0.8, longest_loss=400, filled_share=0.3, packet_bytes=_SMALL
    ),
    "one_cpu": Recording(
        lost_event_share=0.8,
        longest_loss=400,
        packet_bytes=_SMALL,
        lossy_cpus=(1,),
    ),
    "late_one_cpu": Recording(
        start_ns=SECOND // 5,
        lost_event_share=0.8,
        longest_loss=400,
        packet_bytes=_SMALL,
        lossy_cpus=(1,),
    ),
    "stopped_at_rotation": Recording(
        pauses=((SECOND // 2, SECOND * 3 // 4),), rotations=(SECOND // 3, SECOND * 2 // 3)
    ),
    "snapshots": Recording(
        snapshots=(SECOND // 3, SECOND // 2, SECOND * 9 // 10), kept_packets=3, packet_bytes=_SMALL
    ),
    "last_snapshot": Recording(
        snapshots=(SECOND // 2, SECOND * 3 // 5, SECOND * 9 // 10),
        kept_packets=12,
        is_last_snapshot_only=True,
        packet_bytes=_SMALL,
    ),
    "per_process": Recording(buffers=Buffers.PER_PROCESS, clock_error_ns=3_000),
    "drift": Recording(realtime_offset_ns=300_000, slew_ppm=20),
    "behind": Recording(realtime_offset_ns=-200_000, slew_ppm=-20),
    # The clock that makes stamps is set, to and fro; one step is as long as bursts are apart.
    "steps": Recording(realtime_steps=((SECOND // 5, 7_000), (SECOND // 2, -40_000_000))),
    "far": Recording(realtime_offset_ns=7_000_000),
    PERF: Recording(kernel_tracer="perf"),
    "everything": Recording(
        start_ns=SECOND // 20,
        pauses=((SECOND // 3, SECOND // 2),),
        rotations=(SECOND * 2 // 3,),
        buffers=Buffers.PER_PROCESS,
        lost_event_share=0.2,
        lost_packet_share=0.05,
        unfinished_streams=1,
        slew_ppm=-20,
    ),
}
# Faults do not depend on the layout except for stamps; these layouts have all kinds of stamps.
FAULTY_LAYOUTS = ("jazzy", "humble", "humble-fastdds")
FAULTY_SYSTEMS = ("pipeline", "two_hosts")
# What every system is recorded with once, since what it costs depends on what the system does.
EVERY_LAYOUT = "jazzy"
# Only this one has channels.
CHANNEL_LAYOUT = "rolling"
EVERY_FAULT = ("loss", "packets", "truncated", "rotated", "chunk_missing")
# Where losses meet threads that move, and messages that come twice.
GAP_SYSTEMS = ("container", "container_multi_threaded")
GAP_RECORDINGS = (
    "brim",
    "one_cpu",
    "late_one_cpu",
    "pause",
    "stopped_at_rotation",
    "snapshots",
    "last_snapshot",
)
# Links found by time alone depend on how stamps and the trace's clock differ.
TIMED_LAYOUTS = ("humble", "iron")
TIMED_SYSTEMS = ("bursts", "bursts_two_hosts")
# In these layouts, recordings ten times as long show more: messages that wait behind a gap, copies,
# and stretches of time in which the clocks differ otherwise.
LONG_SYSTEMS = (
    "channels",
    "container",
    "host_chain",
    "layers",
    "losses",
    "mixed_intra_process",
    "overwritten_copies",
    "polled",
    "rivals",
    "services",
)
LONG_RECORDINGS = ("loss", "lost_begin", "steps")
# Steps cost these more: only other hosts take what host_chain publishes, in three seconds; polled
# lasts two seconds, half a second of them before a step.
SHORT_BESIDE_STEPS = {"host_chain", "polled"}
# What the kernel does, does not depend on the layout.
KERNEL_SYSTEMS = ("cpu_hog", "real_time", "shared_map", "shared_memory", "kernel_losses")
# What comes and goes in these does so after a second; clocks that drift, or are known from few
# messages, take one to be known.
WHOLE = (
    "losses",
    "restarts",
    "container_restarts",
    "host_chain",
    "services",
    "actions",
    "stall",
    *KERNEL_SYSTEMS,
)
# The truth names hosts as their traces do: holes of one would be looked for in the other.
ONE_NAME = {"containers_one_hostname"}
QUICK = (("pipeline", "jazzy"), ("two_hosts", "humble-fastdds"))
# Of each system, in a sample: so many seeds, and these lengths.
SAMPLED_SEEDS = 3
SAMPLED_FACTORS = (0.1, 1)


@dataclass(frozen=True)
class Case:
    """A simulation to be compared."""

    system: str
    layout: str
    recording: str
    scenario: Scenario
    factor: float
    seed: int

    @property
    def run(self) -> str:
        """The options that repeat it, beside the three names."""
        return f"--factor {self.factor:g} --seed {self.seed}"


@dataclass(frozen=True)
class Judged:
    """A score and where it comes from; `run` has what else repeats it."""

    system: str
    layout: str
    recording: str
    score: Score
    run: str = ""

    @property
    def is_good(self) -> bool:
        """Whether every figure is as good as it must be."""
        if self.system in LOSSY_RECORDINGS:
            return not self.score.wrong and self.score.recall >= LOSSY_RECALL
        least = min(LOWEST_RECALL.get(name, 1) for name in (self.system, self.recording))
        # If one message completes several sets, the recording does not tell which of them a
        # publication has: its links are marked, and some guess another set.
        is_marked = self.score.kind == "approximate_sync" and (
            self.score.missing <= self.score.misguessed
        )
        is_complete = is_marked or self.score.recall >= least
        unmarked = self.score.wrong - self.score.loss_affected
        most = MOST_LOSS_AFFECTED.get(self.system, 0) * self.score.found
        # Without callbacks a pair is a guess, and the timing of a run may allow others.
        is_guess = self.layout == "rclpy" and self.score.kind == "take_adjacent"
        faults = (unmarked, self.score.repeated, 0 if is_guess else self.score.doubted)
        return is_complete and self.score.loss_affected <= most and not any(faults)


def cases(arguments: argparse.Namespace) -> Iterator[Case]:
    """What is to be simulated."""
    known = scenarios()
    names = [*known, LONG]
    part = names[names.index(arguments.first) : names.index(arguments.last) + 1]
    # Agnocast has no events in these layouts: tests/truth/test_agnocast.py compares it in its own.
    # CARET leaves out events that the others are judged by (test_caret_arrival.py).
    common = [layout for layout in layouts() if not layout.endswith(("-agnocast", "-caret"))]
    for system in arguments.system or [name for name in part if name != "agnocast"]:
        if system == LONG:
            if not arguments.quick:
                yield Case(LONG, "humble", "drift", long_recording(), 1, arguments.seed)
            continue
        for layout in arguments.layout or common:
            is_left_out = system in KERNEL_SYSTEMS and layout != EVERY_LAYOUT
            if is_left_out and not arguments.layout:
                continue
            for recording in arguments.recording or RECORDINGS:
                # Nothing else differs.
                if recording == PERF and system not in KERNEL_SYSTEMS:
                    continue
                is_faulty = recording != PERFECT
                is_asked_for = arguments.system or arguments.layout or arguments.recording
                is_long = (
                    not is_asked_for
                    and layout in TIMED_LAYOUTS
                    and system in LONG_SYSTEMS
                    and recording in LONG_RECORDINGS
                    and not (system in SHORT_BESIDE_STEPS and recording == "steps")
                )
                is_usual = (
                    not is_faulty
                    or (system in FAULTY_SYSTEMS and layout in FAULTY_LAYOUTS)
                    or (system in TIMED_SYSTEMS and layout in TIMED_LAYOUTS)
                    or recording == PERF
                    or is_long
                    or (
                        layout == (CHANNEL_LAYOUT if system == "channels" else EVERY_LAYOUT)
                        and recording in EVERY_FAULT
                        and system not in ONE_NAME
                    )
                    or (
                        layout == EVERY_LAYOUT
                        and system in GAP_SYSTEMS
                        and recording in GAP_RECORDINGS
                    )
                )
                if arguments.quick:
                    is_usual = (system, layout) in QUICK and recording in {PERFECT, "loss"}
                elif is_asked_for:
                    is_usual = True
                if is_usual:
                    scenario = known[system]
                    least_factor = 1 if is_long or system in WHOLE else 0
                    factor = max(least_factor, arguments.factor)
                    yield Case(system, layout, recording, scenario, factor, arguments.seed)


def sample(everything: Iterable[Case], day: int) -> Iterator[Case]:
    """Draw the cases of a day: of each system, seeds and lengths, each in one of its cases."""
    of_system: dict[str, list[Case]] = defaultdict(list)
    for case in everything:
        of_system[case.system].append(case)
    for system, possible in of_system.items():
        # What is drawn for one system does not depend on which others there are.
        random = Random(f"{day}/{system}")
        if system == LONG:
            yield from possible
            continue
        for _ in range(SAMPLED_SEEDS):
            seed = random.randrange(10**6)
            for factor in SAMPLED_FACTORS:
                chosen = random.choice(possible)
                least = max(chosen.factor, factor) if system in WHOLE else factor
                yield replace(chosen, factor=least, seed=seed)


def compare(case: Case) -> tuple[list[Judged], list[Drop] | None] | None:
    """Simulate, ingest and compare; drops are None where the database knows no reasons.

    Returns None where nothing was recorded.
    """
    with tempfile.TemporaryDirectory() as temporary:
        simulation = simulate(
            case.scenario,
            Path(temporary) / "trace",
            factor=case.factor,
            seed=case.seed,
            layout=case.layout,
            recording=None if case.system == LONG else RECORDINGS[case.recording],
            clock_offset_ns=350_000_000,
        )
        database = Path(temporary) / "run.duckdb"
        try:
            ingest([simulation.directory], database, events=OWN_EVENTS)
        except TraceError as error:
            if "nothing was recorded" in str(error) and not _has_streams(simulation.directory):
                return None
            # A system that ended before the recording began leaves packets without events.
            if "the trace holds nothing" in str(error) and RECORDINGS[case.recording].start_ns:
                return None
            raise
        scores, drops = compare_simulated(database, simulation.truth)
    return [
        Judged(case.system, case.layout, case.recording, score, case.run) for score in scores
    ], drops


def _has_streams(trace: Path) -> bool:
    streams = trace.glob("**/ust/**/*")
    return any(
        path.stat().st_size for path in streams if path.is_file() and path.name != "metadata"
    )


def compare_recording(truth: Path) -> list[Judged]:
    """Compare a recorded system, given its truth."""
    with tempfile.TemporaryDirectory() as temporary:
        database = Path(temporary) / "run.duckdb"
        is_real = truth.parent.name.startswith("real_")
        # Beside the traces lies the kernel's.
        ingest([truth.parent / "ust" if is_real else truth.parent], database)
        scores = (compare_real if is_real else compare_recorded)(database, truth)
    return [Judged(truth.parent.name, "recorded", "recorded", score) for score in scores]


def show(judged: list[Judged]) -> list[Judged]:
    """Print a line for each, and return them."""
    for one in judged:
        score = one.score
        mark = " " if one.is_good else "✗"
        notes = f"  ({score.loss_affected} marked)" if score.loss_affected else ""
        notes += f"  ({score.misguessed} misguessed)" if score.misguessed else ""
        notes += f"  ({score.repeated} repeated)" if score.repeated else ""
        notes += f"  ({score.doubted} doubted)" if score.doubted else ""
        print(
            f"{mark} {one.system:24} {one.layout:27} {one.recording:12} {score.kind:18} "
            f"{score.happened:7} {score.decided:7} {score.found:7} {score.wrong:5} "
            f"{score.missing:7} {score.precision:.4f} {score.recall:.4f}  {score.labels}{notes}"
            f"{'' if one.is_good else f'  {one.run}'}",
            flush=True,
        )
    return judged


def main() -> None:
    """Compare everything and say what is wrong."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--system", action="append", choices=[*scenarios(), LONG])
    parser.add_argument("--layout", action="append", choices=list(layouts()))
    parser.add_argument("--recording", action="append", choices=list(RECORDINGS))
    parser.add_argument("--sample", type=int, metavar="DAY", help="the sample of another day")
    parser.add_argument("--all", action="store_true", help="every layout and every fault")
    parser.add_argument("--quick", action="store_true", help="a few only")
    ordered = [*scenarios(), LONG]
    parser.add_argument("--first", choices=ordered, default=ordered[0], help="system to begin with")
    parser.add_argument("--last", choices=ordered, default=LONG, help="system to end with")
    parser.add_argument("--factor", type=float, default=0.1, help="length of the simulations")
    parser.add_argument("--seed", type=int, default=0, help="of all that is random in them")
    parser.add_argument("--traces", type=Path, default=SHARED_TRACES, help="recorded systems")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at work")
    parser.add_argument("--csv", type=Path, help="write the table there as well")
    arguments = parser.parse_args()

    chosen = arguments.system or arguments.layout or arguments.recording or arguments.quick
    todo = list(cases(arguments))
    if not chosen and not arguments.all:
        day = arguments.sample or int(f"{datetime.now(timezone.utc):%Y%m%d}")
        todo = list(sample(todo, day))
        print(f"to repeat it: --sample {day}")
    print(
        f"  {'system':24} {'layout':27} {'recording':12} {'kind':18} {'true':>7} {'decided':>7} "
        f"{'found':>7} {'wrong':>5} {'missing':>7} {'prec.':>6} {'recall':>6}  right/found"
    )
    everything: list[Judged] = []
    reasons: list[tuple[Case, Drop]] = []
    has_reasons = False
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for case, compared in zip(todo, pool.map(compare, todo), strict=True):
            if compared is None:
                where = f"{case.system:24} {case.layout:27} {case.recording:12}"
                print(f"  {where} nothing recorded  {case.run}")
                continue
            judged, drops = compared
            has_reasons |= drops is not None
            reasons += [(case, drop) for drop in drops or []]
            everything += show(judged)
        if not chosen and arguments.last == LONG:
            truths = sorted(arguments.traces.glob("*/truth.jsonl.gz"))
            if not truths:
                print(f"note: no recorded systems — {arguments.traces}", file=sys.stderr)
            for judged in pool.map(compare_recording, truths):
                everything += show(judged)

    are_reasons_right = show_reasons(reasons, has_reasons)
    if arguments.csv:
        write_csv(arguments.csv, everything)
    bad = [one for one in everything if not one.is_good]
    print(f"\n{len(everything)} figures, {len(bad)} of them not what they must be")
    sys.exit(1 if bad or not are_reasons_right else 0)


def show_reasons(reasons: list[tuple[Case, Drop]], has_reasons: bool) -> bool:
    """Print why messages were not delivered, said and true; whether all that must agree does."""
    if not has_reasons:
        print("\nnote: this version gives no reasons for what was not delivered", file=sys.stderr)
        return True
    counted: dict[tuple[str, str, str, str, bool], int] = {}
    where: dict[tuple[str, str, str, str, bool], dict[str, None]] = {}
    for case, drop in reasons:
        fault = case.recording if case.recording == PERFECT else "with faults"
        key = (fault, drop.truth, drop.reason, drop.undecided or "", drop.is_right)
        counted[key] = counted.get(key, 0) + drop.messages
        where.setdefault(key, {})[f"{case.system}/{case.layout}/{case.recording} {case.run}"] = None
    print(
        f"\n  {'recording':12} {'true reason':20} {'reason given':20} {'messages':>8}  not decided"
    )
    is_all_right = True
    for key, messages in sorted(counted.items()):
        fault, truth, reason, undecided, is_right = key
        is_bad = not is_right and not undecided
        is_all_right &= not is_bad
        print(
            f"{'✗' if is_bad else ' '} {fault:12} {truth:20} {reason:20} {messages:8}  "
            f"{', '.join(where[key]) if is_bad else '' if is_right else undecided}"
        )
    return is_all_right


def write_csv(path: Path, judged: list[Judged]) -> None:
    """Write every figure."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        names = list(Score.__dataclass_fields__)
        writer.writerow(["system", "layout", "recording", *names])
        for one in judged:
            values = [getattr(one.score, name) for name in names]
            writer.writerow([one.system, one.layout, one.recording, *values])


if __name__ == "__main__":
    main()
