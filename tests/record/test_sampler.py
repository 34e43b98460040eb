"""Samples of the system beside a recording: what is read of a made-up /proc, and written."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from msgflow.record.sampler import Sampler
from msgflow.record.system_samples import sampled
from msgflow.trace.discovery import SYSTEM_SAMPLES as FILE
from msgflow.trace.system_samples import read_system_samples

MAPS = "7f00-7f01 r-xp 0 00:00 1 /opt/ros/lib/libtracetools.so\n"
MOUNTS = """cgroup /sys/fs/cgroup/memory cgroup rw,memory 0 0
cgroup /sys/fs/cgroup/cpu cgroup rw,relatime,cpuacct,cpu 0 0
cgroup2 /sys/fs/cgroup/unified cgroup2 rw 0 0
"""
STATUS = """Name:\ttalker
NStgid:\t{pid}\t7
NSpid:\t{tid}\t8
voluntary_ctxt_switches:\t11
nonvoluntary_ctxt_switches:\t12
"""


class Machine:
    """A made-up machine, below a folder."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.lines: list[str] = []
        self.write("proc/mounts", MOUNTS)
        self.write("proc/sys/kernel/random/boot_id", "boot\n")
        self._sampler: Sampler | None = None

    def write(self, name: str, text: str) -> None:
        """Write a file in place: what is open sees it, as in /proc."""
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(path, "r+" if path.exists() else "w") as file:
            file.write(text)
            file.truncate()

    def process(
        self, pid: int, name: str = "talker", *, ticks: int = 0, size: int = 100, ppid: int = 1
    ) -> None:
        self.write(f"proc/{pid}/stat", self._stat(pid, name, "S", ppid, ticks, size))

    def thread(
        self, pid: int, tid: int, running: int = 0, waiting: int = 0, state: str = "S"
    ) -> None:
        folder = f"proc/{pid}/task/{tid}"
        self.write(f"{folder}/schedstat", f"{running} {waiting} 3\n")
        self.write(f"{folder}/stat", self._stat(tid, ") R 1", state, 1, 0, 100))
        self.write(f"{folder}/status", STATUS.format(pid=pid, tid=tid))

    def traced(self, pid: int = 100) -> None:
        self.process(pid)
        self.write(f"proc/{pid}/maps", MAPS)
        self.thread(pid, pid)

    @staticmethod
    def _stat(pid: int, name: str, state: str, ppid: int, ticks: int, size: int) -> str:
        others = f"{ppid} 3 4 5 6 7 21 9 22 11 {ticks} 1000 14 15 16 17 1 19 20 {size}"
        fields = [state, *others.split(), *map(str, range(100, 130))]
        return f"{pid} ({name}) {' '.join(fields)}\n"

    def look(self, *, at_all: bool = True) -> list[str]:
        """Return the lines of a look, with spaces for tabs, but for its time."""
        self.lines.clear()
        if self._sampler is None:
            self._sampler = Sampler(lambda line: self.lines.append(line.decode()), self.root)
        self._sampler.look(at_all=at_all)
        if at_all:
            self._sampler.look_at_all()
        return [line.replace("\t", " ") for line in self.lines if "look\t" not in line]


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def of(kind: str, lines: list[str]) -> list[str]:
    return [line for line in lines if line.startswith(f"{kind} ")]


def test_the_first_line_says_what_is_true_of_all(machine: Machine) -> None:
    (head,) = machine.look()
    name, boot, ticks, cpus, recorders = head.removeprefix("msgflow usage 1 ").split(" ", 4)
    assert (name, boot) == (os.uname().nodename, "boot")
    assert (int(ticks), int(cpus)) == (os.sysconf("SC_CLK_TCK"), os.cpu_count())
    assert recorders == f"{os.getppid()} {os.getpid()}"


def test_threads_of_traced_processes_are_read(machine: Machine) -> None:
    machine.traced()
    machine.thread(100, 101)
    machine.process(200)
    machine.thread(200, 200)
    found = machine.look()
    assert sorted(line.split()[3:] for line in of("thread", found)) == [
        ["100", "7", "100", "8"],
        ["100", "7", "101", "8"],
    ]
    machine.thread(100, 101, running=50, waiting=60, state="D")
    numbers = {line.split()[5]: line.split()[1] for line in of("thread", found)}
    machine.look(at_all=False)
    machine.thread(100, 101, running=70, waiting=60, state="R")
    (line,) = machine.look(at_all=False)
    kind, number, at, *fields = line.split()
    assert (kind, number) == ("run", numbers["101"])
    assert 0 <= int(at) < 10**9
    assert fields == ["R", "70", "60", "21", "22", "118", "11", "12"]
    assert machine.look(at_all=False) == []


def test_a_thread_that_waits_for_a_cpu_is_seen_once_a_second(machine: Machine) -> None:
    """Its times tell when it had one. One that did not sleep is looked at each time."""
    machine.traced()
    machine.look()
    machine.look()
    machine.thread(100, 100, state="R")
    assert machine.look(at_all=False) == []
    (line,) = machine.look()
    assert line.split()[3] == "R"
    machine.thread(100, 100, state="D")
    (line,) = machine.look(at_all=False)
    assert line.split()[3] == "D"


def test_the_switches_of_a_thread_are_read_where_it_ran(machine: Machine) -> None:
    status = "proc/100/task/100/status", STATUS.format(pid=1, tid=1).replace("11", "15")
    machine.traced()
    machine.look()
    machine.look()
    machine.write(*status)
    machine.look()
    machine.thread(100, 100, running=1)
    machine.write(*status)
    (line,) = machine.look()
    assert line.endswith(" 11 12")
    machine.thread(100, 100, running=2)
    (line,) = machine.look()
    assert line.endswith(" 15 12")


def test_threads_come_and_go(machine: Machine) -> None:
    machine.traced()
    machine.look()
    machine.thread(100, 102)
    assert len(of("thread", machine.look())) == 1
    (line,) = of("run", machine.look(at_all=False))
    for file in sorted((machine.root / "proc/100/task/102").iterdir()):
        file.unlink()
    (machine.root / "proc/100/task/102").rmdir()
    assert machine.look() == [f"gone {line.split()[1]}"]


def test_a_process_that_ends_while_it_is_read(machine: Machine) -> None:
    """Then the kernel has nothing more of it, and another may get its number."""
    machine.traced()
    machine.look()
    machine.write("proc/100/task/100/schedstat", "")
    assert [line.split()[0] for line in machine.look(at_all=False)] == ["gone"]
    machine.write("proc/100/stat", "")
    assert machine.look() == []
    machine.process(100, "later")
    (line,) = of("process", machine.look())
    assert line.endswith(" 100 1 later ")


def test_a_library_is_looked_for_where_memory_has_changed(machine: Machine) -> None:
    machine.process(100)
    machine.look()
    machine.write("proc/100/maps", MAPS)
    machine.thread(100, 100)
    assert of("thread", machine.look()) == []
    machine.process(100, size=101)
    assert len(of("thread", machine.look())) == 1


def test_programs_are_written_once_and_their_time_where_it_changed(machine: Machine) -> None:
    machine.write("proc/100/cmdline", f"/opt/talker\0--name\0a b\0{'x' * 5000}")
    machine.process(100, "talker", ticks=5, ppid=42)
    first = machine.look()
    command = f"/opt/talker --name a b {'x' * 5000}"[: 1 << 8]
    assert of("process", first) == [f"process 1 100 42 talker {command}"]
    assert of("cpu", first) == ["cpu 1 1005"]
    assert machine.look() == []
    machine.process(100, "talker", ticks=7, ppid=42)
    assert machine.look() == ["cpu 1 1007"]
    machine.write("proc/100/cmdline", "other")
    machine.process(100, "other", ticks=7, ppid=42)
    assert machine.look() == ["process 1 100 42 other other"]


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("a\tb\nc\x1b[31m", "a\ufffdb\ufffdc\ufffd[31m"),
        ("a) R 1 (b", "a) R 1 (b"),
        ("\x85\u2028\x7f", "\ufffd\ufffd\ufffd"),
        ("grüße", "grüße"),
    ],
)
def test_names_have_no_controls(machine: Machine, name: str, written: str) -> None:
    machine.write("proc/100/cmdline", name)
    machine.process(100, name)
    machine.look()
    (line,) = [line for line in machine.lines if line.startswith("process")]
    assert line == f"process\t1\t100\t1\t{written}\t{written}"


def test_quotas_of_a_process_and_those_around_it(machine: Machine) -> None:
    """Of both versions; a namespace hides what is above it."""
    machine.traced()
    machine.write("proc/100/cgroup", "4:memory:/x\n2:cpu,cpuacct:/a/b\n1:cpuset:/\n0::/../c\n")
    one = "sys/fs/cgroup/cpu"
    machine.write(f"{one}/a/b/cpu.stat", "nr_periods 9\nnr_throttled 0\nthrottled_time 5\n")
    machine.write(f"{one}/a/b/cpu.cfs_quota_us", "50000\n")
    machine.write(f"{one}/a/b/cpu.cfs_period_us", "100000\n")
    machine.write(f"{one}/cpu.stat", "usage_usec 1\n")
    found = machine.look()
    groups = {line.split()[2]: line.split()[1] for line in of("cgroup", found)}
    assert set(groups) == {"/a/b", "/"}
    assert {line.split()[2] for line in of("member", found)} == set(groups.values())
    assert of("limit", found) == [f"limit {groups['/a/b']} 50000 100000"]
    assert of("throttled", machine.look(at_all=False)) == [
        f"throttled {groups['/a/b']} nr_throttled 0 throttled_time 5"
    ]
    machine.write(f"{one}/a/b/cpu.stat", "nr_periods 10\nnr_throttled 0\nthrottled_time 5\n")
    assert machine.look() == []
    two = "sys/fs/cgroup/unified/c"
    machine.write(f"{two}/cpu.stat", "usage_usec 9\nnr_throttled 1\nthrottled_usec 6\n")
    machine.write(f"{two}/cpu.max", "max 100000\n")
    machine.write("proc/100/cgroup", "0::/c\n")
    found = machine.look()
    (group,) = (line.split()[1] for line in of("cgroup", found))
    assert of("limit", found) == [f"limit {group} max 100000"]
    assert machine.look() == [f"throttled {group} nr_throttled 1 throttled_usec 6"]


def test_the_machine(machine: Machine) -> None:
    cpus = "sys/devices/system/cpu"
    machine.write("proc/stat", "cpu  1 2 3\ncpu0 1 2 3\n")
    machine.write("proc/pressure/io", "some avg10=0.00 total=5\nfull avg10=0.00 total=1\n")
    for number in (0, 1):
        machine.write(f"{cpus}/cpufreq/policy{number}/scaling_cur_freq", f"{number}00\n")
        machine.write(f"{cpus}/cpu{number}/thermal_throttle/core_throttle_count", f"{number}\n")
    machine.write(f"{cpus}/cpufreq/policy0/cpuinfo_max_freq", "900\n")
    expected = [
        "host cpu cpu  1 2 3",
        "host io_pressure some avg10=0.00 total=5",
        "host frequency 000 100",
        "host most_frequency 900",
        "host throttling 0 1",
    ]
    assert of("host", machine.look()) == expected
    assert machine.look() == expected


def lines_of(directory: Path) -> list[str]:
    damages: list[str] = []
    found = [line for lines in read_system_samples(directory / FILE, damages) for line in lines]
    assert damages == []
    return found


def test_this_machine_is_sampled_ten_times_a_second(tmp_path: Path) -> None:
    with sampled(tmp_path, pytest.fail):
        begun = time.monotonic_ns()
        while time.monotonic_ns() - begun < 1.5e9:
            pass
    lines = [line.split("\t") for line in lines_of(tmp_path)]
    looks = [int(fields[1]) for fields in lines if fields[0] == "look"]
    assert 5 <= len(looks) <= 20
    own = next(f[1] for f in lines if f[0] == "process" and f[2] == str(os.getpid()))
    ticks = [int(fields[2]) for fields in lines if fields[:2] == ["cpu", own]]
    assert ticks[-1] - ticks[0] > 30
    assert str(os.getpid()) in lines[0][5].split()


def test_where_looking_takes_long_it_looks_less_often(tmp_path: Path) -> None:
    script = (
        "import sys; from msgflow.record import sampler\n"
        "sampler._MOST_SHARE = 1e-5; sampler.main(sys.argv[1])"
    )
    command = [sys.executable, "-c", script, str(tmp_path / FILE)]
    with subprocess.Popen(command, stdin=subprocess.PIPE):
        time.sleep(3)
    # One when it begins, one when it ends, and few between: otherwise there are some thirty.
    assert len([line for line in lines_of(tmp_path) if line.startswith("look")]) <= 9


def test_a_recording_that_is_killed_leaves_what_was_sampled(tmp_path: Path) -> None:
    """And nothing that goes on."""
    script = (
        "import sys, time; from pathlib import Path\n"
        "from msgflow.record.system_samples import sampled\n"
        "with sampled(Path(sys.argv[1]), print): print('ready', flush=True); time.sleep(60)"
    )
    command = [sys.executable, "-c", script, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as recording:
        assert recording.stdout is not None
        recording.stdout.readline()
        path = tmp_path / FILE
        until = time.monotonic() + 10
        while not (path.exists() and path.stat().st_size) and time.monotonic() < until:
            time.sleep(0.05)
        recording.kill()
    until = time.monotonic() + 10
    while time.monotonic() < until:
        damages: list[str] = []
        if list(read_system_samples(path, damages)) and not damages:
            break
        time.sleep(0.05)
    assert damages == []


@pytest.mark.parametrize("target", ["/dev/full", "/nowhere/usage.gz"])
def test_what_goes_wrong_is_a_note(tmp_path: Path, target: str) -> None:
    """A full disk, or another fault, never ends the recording."""
    (tmp_path / FILE).symlink_to(target)
    notes: list[str] = []
    with sampled(tmp_path, notes.append):
        pass
    (note,) = notes
    assert note.startswith("the system is not sampled until the end of the recording: ")
    assert FILE in note
