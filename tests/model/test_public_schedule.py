"""Running time of threads in public kernel traces, against a plain count over Babeltrace's text.

These traces have no ROS events. The test adds a ROS process whose threads are the busiest ones of
the kernel trace, and lets each call callbacks while the kernel says that it runs.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections import defaultdict
from pathlib import Path

import pyarrow as pa
import pytest
from support.analysis import Analyse
from support.kernel_schedule import Kernel, call
from support.ros_system import RosSystem
from support.same_batches import read
from support.staged_events import Thread
from support.thorough import few

from msgflow.ingest import catalogue

_SWITCH = re.compile(
    r"^\[(?P<second>\d+)\.(?P<rest>\d{9})\] .*sched_switch: .*?cpu(?:_id)? = (?P<cpu>\d+).*?"
    r"prev_[tp]id = (?P<prev>\d+).*?next_[tp]id = (?P<next>\d+)",
    re.MULTILINE,
)
PROCESS, THREADS, CALLBACKS = 1, 8, 20

Run = list[int]
"""CPU, begin and end of a time in which a thread had a CPU, in nanoseconds."""


def without_index(trace: Path, to: Path) -> Path:
    """Copy the files that Babeltrace can read: it takes an index for a stream."""
    return shutil.copytree(trace, to, ignore=shutil.ignore_patterns("*.idx"))


def counted(trace: Path) -> dict[int, list[Run]]:
    """Return when each thread had a CPU, by the text that Babeltrace prints of all switches."""
    text = subprocess.run(
        ["babeltrace2", "--clock-seconds", "--clock-gmt", "--no-delta", str(trace)],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    runs: dict[int, list[Run]] = defaultdict(list)
    taken: dict[str, tuple[int, int]] = {}
    for found in _SWITCH.finditer(text):
        now = int(found["second"]) * 10**9 + int(found["rest"])
        tid, begin = taken.get(found["cpu"], (None, 0))
        if tid == int(found["prev"]):
            runs[tid].append([int(found["cpu"]), begin, now])
        taken[found["cpu"]] = int(found["next"]), now
    return runs


@pytest.mark.parametrize("name", few(["perf-taskset2", "many-threads"], "perf-taskset2"))
def test_running_time_is_a_plain_count(
    name: str, shared_kernel: Path, tmp_path: Path, system: RosSystem, analyse: Analyse
) -> None:
    if shutil.which("babeltrace2") is None:
        pytest.skip("no babeltrace2 here: apt install babeltrace2")
    trace = without_index(shared_kernel / "public" / name, tmp_path / name)
    runs = counted(trace)
    lengths = {tid: sum(end - begin for _, begin, end in runs[tid]) for tid in runs if tid}
    busiest = sorted(lengths, key=lambda tid: -lengths[tid])[:THREADS]
    kernel = Kernel(system)
    wanted = {
        alias: known
        for known in catalogue.load().tracepoints.values()
        if known.name in ("sched_switch", "sched_waking")
        for alias in (known.name, *known.aliases)
    }
    # Of old versions of perf only a field of each event says on which CPU it happened.
    schemas = {
        alias: known.arrow_schema().append(pa.field("perf_cpu", pa.int32()))
        for alias, known in wanted.items()
    }
    content = read(trace, wanted=schemas)
    for event in wanted.keys() & content.rows.keys():
        for values in content.rows[event]:
            row = dict(zip(content.schemas[event].names, values, strict=True))
            fields = {name: row[name] for name in wanted[event].arrow_schema().names}
            cpu = row["perf_cpu"] if row["cpu_id"] is None else row["cpu_id"]
            kernel.add(wanted[event].name, row["ts_ns"], cpu, **fields)
    for tid in busiest:
        for cpu, begin, end in runs[tid][:CALLBACKS]:
            third = (end - begin) // 3
            call(system, begin + third, end - third, Thread(PROCESS, tid, cpu=cpu))
    model = analyse(system)
    states = model.rows(
        "SELECT t.tid, s.cpu, s.start_ns, s.end_ns FROM thread_state AS s "
        "JOIN thread AS t USING (thread_id) WHERE s.state = 'running' ORDER BY s.start_ns"
    )
    # The model knows who runs between the first and the last packet, the text between switches.
    measured = {
        tid: [
            run
            for of, *run in states
            if of == tid and runs[tid][0][1] <= run[1] and run[2] <= runs[tid][-1][2]
        ]
        for tid in busiest
    }
    assert measured == {tid: runs[tid] for tid in busiest}
    assert sum(map(len, measured.values())) > 100
