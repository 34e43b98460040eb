"""What tracing costs a robot of Python nodes: latency, CPU, nanoseconds and bytes per event.

    python benchmarks/overhead.py --python PYTHON [--rounds 20] [--messages 50] [--hops 5]
        [--rate 10] [--work 0.05] [--seed 0]

First an event of C alone: with a session, with one that reads the clock of the thread beside it,
and that in a process that may not. Then a robot.

Five messages lead from a source over four nodes to a sink, each node in a process of its own; each
but the source waits for 50 ms before it sends its message on. The first one's time is in all of
them: the sink knows the latency without a trace. In each round, messages go at 10 Hz with nothing
recorded, with LTTng, with LTTng and the tracer of Python nodes, with these and the clocks of
threads (`msgflow record`), with that tracer and nothing recorded, with samples of functions at 99
Hz where perf may, and with the kernel where LTTng can trace it; in an order that is drawn. Nodes
with the tracer are others than those without; both run all the time. CPU time is that of the nodes:
with samples it has their interrupts, and not what perf itself takes to write them.
`--hops 9 --rate 100 --work 0` are ten nodes with 1,000 callbacks per second.

Differences are to nothing recorded; intervals hold 95 % of what drawing rounds anew gives. PYTHON
has the wheels of ROS 2 (`make ros`).
"""

from __future__ import annotations

import argparse
import contextlib
import random
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from recording.recorder import one_at_a_time, require, ros_environment
from recording.tracetools import build_tracetools

from msgflow import trace
from msgflow.record import cpu_time, perf
from msgflow.record.daemon import session_daemon
from msgflow.record.perf import Rate, recorded_samples
from msgflow.record.program import PYTHON_NODES
from msgflow.record.recording import recorded_packets
from msgflow.record.session import Channel, can_trace_kernel, recording_session

_CHAIN = Path(__file__).parent / "recording" / "chain.py"
_REFUSE_PERF = Path(__file__).parent.parent / "tests" / "record" / "refuse_perf.py"
_DRAWS = 2000
_NOTHING = "nothing"
_SAMPLED = "LTTng, and functions at 99 Hz"
_WITH_CLOCKS = "LTTng, Python and clocks of threads"
_NAME = "msgflow-overhead"
# Processes learn of a session a little later.
_UNTIL_KNOWN = 0.5
_CHANNEL = Channel(("ros2:*",), "1M", 4)
# Says how long a call of a tracepoint takes, for each line of its input.
_CALL = """
import ctypes, sys, time
event = ctypes.CDLL(sys.argv[1]).ros_trace_callback_end
event.argtypes, event.restype = [ctypes.c_void_p], None
for _ in sys.stdin:
    times = []
    for _ in range(50):
        begin = time.perf_counter_ns()
        for _ in range(500):
            event(0)
        times.append(time.perf_counter_ns() - begin)
    print(min(times) / 500, flush=True)
"""


@dataclass(frozen=True)
class Block:
    """What was measured of some messages.

    Attributes:
        latencies_ns: of each of them.
        cpu_ns: of all nodes, for each of them.
        events: recorded for each of them.
        bytes: likewise.
    """

    latencies_ns: list[int]
    cpu_ns: float
    events: float
    bytes: float


class Chain:
    """The nodes, in a domain of their own."""

    def __init__(
        self, python: Path, environment: dict[str, str], domain: int, hops: int, work: float
    ) -> None:
        self._nodes = [
            subprocess.Popen(
                [python, _CHAIN, str(number), str(hops), str(domain), str(work)],
                env=environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            for number in range(hops + 1)
        ]
        for node in self._nodes:
            assert node.stdout is not None
            node.stdout.readline()

    def send(self, messages: int, rate: float) -> tuple[list[int], float]:
        """Let so many messages go; return their latencies, and nanoseconds of CPU of one."""
        source, sink = self._nodes[0].stdin, self._nodes[-1].stdout
        assert source is not None
        assert sink is not None
        before = self._cpu_ns()
        print(messages, rate, file=source, flush=True)
        latencies = [int(sink.readline()) for _ in range(messages)]
        return latencies, (self._cpu_ns() - before) / messages

    def end(self) -> None:
        """End all processes."""
        for node in self._nodes:
            node.kill()
            node.wait()

    def _cpu_ns(self) -> float:
        # CLOCK_PROCESS_CPUTIME_ID of other processes, as clock_getcpuclockid has it.
        return sum(time.clock_gettime_ns(~node.pid << 3 | 2) for node in self._nodes)


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", type=Path, required=True, help="Python with rclpy")
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--messages", type=int, default=50, help="of a kind and round")
    parser.add_argument("--hops", type=int, default=5, help="from the first to the last node")
    parser.add_argument("--rate", type=float, default=10, help="messages per second")
    parser.add_argument("--work", type=float, default=0.05, help="seconds before a node sends on")
    parser.add_argument("--seed", type=int, default=0, help="of the order")
    given = parser.parse_args()
    require(given.python)
    blocks = measure(given)
    report(blocks, random.Random(given.seed))


def measure(given: argparse.Namespace) -> dict[str, list[Block]]:
    """Return the blocks of each kind, one per round."""
    order = random.Random(given.seed)
    blocks = defaultdict(list)
    with contextlib.ExitStack() as stack:
        directory = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        stack.enter_context(one_at_a_time())
        stack.enter_context(session_daemon(with_kernel=True, note=print))
        library = str(build_tracetools(directory))
        measure_events(library, directory)
        environment = ros_environment(given.python) | {"LD_PRELOAD": library}
        plain = Chain(given.python, environment, 41, given.hops, given.work)
        stack.callback(plain.end)
        environment["PYTHONPATH"] = str(PYTHON_NODES)
        traced = Chain(given.python, environment, 42, given.hops, given.work)
        stack.callback(traced.end)
        kinds = {
            _NOTHING: (plain, False, False),
            "LTTng": (plain, True, False),
            "LTTng and Python": (traced, True, False),
            _WITH_CLOCKS: (traced, True, False),
            "the tracer, nothing recorded": (traced, False, False),
        }
        if (reason := perf.why_not(["--all-cpus"])) is None:
            kinds[_SAMPLED] = (plain, True, False)
        else:
            print(f"no samples of functions: {reason}")
        if can_trace_kernel():
            kinds["LTTng, Python and kernel"] = (traced, True, True)
        else:
            print("LTTng cannot trace this kernel: left out")
        for chain in (plain, traced):
            chain.send(given.messages, given.rate)
        for number in range(given.rounds):
            for kind in order.sample(list(kinds), len(kinds)):
                chain, is_recorded, with_kernel = kinds[kind]
                place = directory / f"{number}-{kind}"
                with contextlib.ExitStack() as recording:
                    recording.enter_context(
                        _recorded(place, is_recorded=is_recorded, with_kernel=with_kernel)
                    )
                    if kind == _WITH_CLOCKS:
                        recording.enter_context(
                            cpu_time.recorded_cpu_time(_NAME, place, _CHANNEL, print)
                        )
                        time.sleep(_UNTIL_KNOWN)
                    if kind == _SAMPLED:
                        rate = Rate(99, "fp")
                        recording.enter_context(
                            recorded_samples(place, rate, is_ours=False, note=print)
                        )
                    latencies, cpu_ns = chain.send(given.messages, given.rate)
                events, size = _size(place) if is_recorded else (0, 0)
                blocks[kind].append(
                    Block(latencies, cpu_ns, events / given.messages, size / given.messages)
                )
    return blocks


@contextlib.contextmanager
def _recorded(place: Path, *, is_recorded: bool, with_kernel: bool) -> Iterator[None]:
    if not is_recorded:
        yield
        return
    place.mkdir()
    of_kernel = perf.KERNEL_EVENTS if with_kernel else ()
    with recording_session(_NAME, place, _CHANNEL, of_kernel=of_kernel):
        time.sleep(_UNTIL_KNOWN)
        yield


def measure_events(library: str, directory: Path) -> None:
    """Print what an event of a callback costs, without and with the clock of its thread."""
    command = [sys.executable, "-c", _CALL, library]
    with contextlib.ExitStack() as stack:

        def started(*before: str | Path) -> Callable[[], float]:
            child = stack.enter_context(
                subprocess.Popen(
                    [*before, *command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
                )
            )
            stack.callback(child.kill)

            def measured() -> float:
                assert child.stdin is not None
                assert child.stdout is not None
                print(file=child.stdin, flush=True)
                return float(child.stdout.readline())

            return measured

        usual, refused = started(), started(sys.executable, _REFUSE_PERF)
        nothing = usual()
        for process in (usual, refused):
            place = directory / f"events-{process is usual}"
            with _recorded(place, is_recorded=True, with_kernel=False):
                alone = process() - nothing
                with cpu_time.recorded_cpu_time(_NAME, place, _CHANNEL, print):
                    time.sleep(_UNTIL_KNOWN)
                    print(
                        f"an event {alone:.0f} ns, with the clock of its thread"
                        f" {process() - nothing:.0f} ns"
                        + ("" if process is usual else " where perf_event_open is refused")
                    )


def _size(place: Path) -> tuple[int, int]:
    """Return the events of a recording, and their bytes, without the clocks of threads."""
    parts = [part for part in place.iterdir() if part.is_dir() and part.name != cpu_time.DIRECTORY]
    with trace.open(parts) as traces:
        for _ in traces.batches():
            pass
        return sum(traces.event_counts.values()), recorded_packets(place)[0]


def report(blocks: dict[str, list[Block]], draws: random.Random) -> None:
    """Print a row for each kind."""
    base = blocks[_NOTHING]
    print(f"{len(base)} rounds, {len(base[0].latencies_ns)} messages of each kind in each")
    print(
        "| recorded | median | difference of medians | of means | CPU per message | events | "
        "bytes per event | ns of CPU per event |"
    )
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for kind, some in sorted(blocks.items(), key=lambda item: item[0] != _NOTHING):
        median = statistics.median(_latencies(some)) / 1e6
        cpu = statistics.mean(one.cpu_ns for one in some)
        events = statistics.mean(one.events for one in some)
        cells = [kind, f"{median:.3f} ms"]
        if kind == _NOTHING:
            cells += ["", "", f"{cpu / 1e6:.2f} ms", "", "", ""]
        else:
            for statistic in (statistics.median, statistics.fmean):
                cells.append(_difference(base, some, _of(statistic), draws, 1e6, "ms"))
            cells.append(_difference(base, some, _cpu, draws, 1e6, "ms"))
            more = cpu - _cpu(base)
            cells += (
                [
                    f"{events:.0f}",
                    f"{statistics.mean(one.bytes for one in some) / events:.0f}",
                    f"{more / events:.0f}",
                ]
                if events
                else ["", "", ""]
            )
        print(f"| {' | '.join(cells)} |")


def _latencies(blocks: list[Block]) -> list[int]:
    return [latency for block in blocks for latency in block.latencies_ns]


def _of(statistic: Callable[[list[int]], float]) -> Callable[[list[Block]], float]:
    return lambda blocks: statistic(_latencies(blocks))


def _cpu(blocks: list[Block]) -> float:
    return statistics.fmean(block.cpu_ns for block in blocks)


def _difference(
    base: list[Block],
    some: list[Block],
    value: Callable[[list[Block]], float],
    draws: random.Random,
    scale: float,
    unit: str,
) -> str:
    """Return the difference, with the interval that drawing rounds anew gives."""
    pairs = list(zip(base, some, strict=True))
    differences = []
    for _ in range(_DRAWS):
        drawn = draws.choices(pairs, k=len(pairs))
        differences.append(value([b for _, b in drawn]) - value([a for a, _ in drawn]))
    differences.sort()
    low, high = differences[_DRAWS // 40] / scale, differences[-_DRAWS // 40] / scale
    return f"{(value(some) - value(base)) / scale:+.3f} ({low:+.3f} to {high:+.3f}) {unit}"


if __name__ == "__main__":
    main()
