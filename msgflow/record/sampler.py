"""What the system does during a recording, read from /proc and /sys: a program of its own.

`docs/record.md` says what it writes. Nothing of the recording holds up its looks so, and it imports
little. It ends when its stdin does: when the recording is over, or was killed.
"""

from __future__ import annotations

import gzip
import os
import random
import re
import resource
import select
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path, PurePosixPath

# Seconds between two looks at threads, and between two at all that runs; more where one of the two
# would take more than this share of all CPUs.
_PERIOD, _LONG_PERIOD = 0.1, 1.0
_MOST_SHARE = 0.002
_LIBRARY = b"/libtracetools.so"
_MOST_BYTES = 2048
_LONGEST_COMMAND = 1 << 8
# Lines have tabs between their fields; a name may have any character.
_CONTROLS = dict.fromkeys((*range(32), *range(127, 160), 0x2028, 0x2029), "\ufffd")
_IDS = re.compile(rb"^NStgid:(.*)\nNSpid:(.*)$", re.MULTILINE)
_SWITCHES = re.compile(
    rb"^voluntary_ctxt_switches:\t(\d+)\nnonvoluntary_ctxt_switches:\t(\d+)", re.MULTILINE
)
_PRESSURE = "proc/pressure"
_CPUS = "sys/devices/system/cpu"
# Files of the whole machine, whose first lines are read.
_OF_HOST = {
    b"cpu": "proc/stat",
    b"cpu_pressure": f"{_PRESSURE}/cpu",
    b"io_pressure": f"{_PRESSURE}/io",
    b"memory_pressure": f"{_PRESSURE}/memory",
    b"frequency": f"{_CPUS}/cpufreq/policy*/scaling_cur_freq",
    b"most_frequency": f"{_CPUS}/cpufreq/policy*/cpuinfo_max_freq",
    b"throttling": f"{_CPUS}/cpu*/thermal_throttle/core_throttle_count",
}


@dataclass(slots=True)
class _Thread:
    """A thread of a traced process, and what was last seen of it."""

    number: int
    files: list[int]  # schedstat, stat and status
    last: tuple[bytes, bytes] = (b"", b"")  # its times, and its state
    at_status: tuple[bytes, bytes] | None = None  # the same, when its status was read
    switches: bytes = b"\t"  # of both kinds


@dataclass(slots=True)
class _Process:
    """A process, and what was last seen of it."""

    number: int
    file: int  # stat
    last: bytes = b""  # what it said
    name: bytes = b""
    ticks: int = 0  # of CPU time
    size: bytes = b""  # of its memory
    is_traced: bool = False
    cgroups: bytes = b""
    threads: dict[str, _Thread] = field(default_factory=dict)


@dataclass(slots=True)
class _Cgroup:
    """A group of processes that may have a quota, and what was last seen of it."""

    number: int
    file: int  # cpu.stat
    folder: str
    throttled: bytes = b""
    limit: bytes = b""


class Sampler:
    """Looks at threads, programs and the machine, and writes what has changed since it looked last.

    Its files stay open: to open one takes several times as long as to read it.
    """

    def __init__(self, write: Callable[[bytes], None], root: Path = Path("/")) -> None:
        """Write the first line; `root` is where /proc and /sys are."""
        self._write = write
        self._root = str(root).rstrip("/")
        self._numbers = count(1)
        self._processes: dict[str, _Process] = {}
        self._cgroups: dict[str, _Cgroup] = {}
        self._of_host: dict[bytes, list[int]] = {name: [] for name in _OF_HOST}
        for name, pattern in _OF_HOST.items():
            for path in sorted(root.glob(pattern)):
                # Pressure may be switched off.
                with suppress(OSError):
                    self._of_host[name].append(os.open(path, os.O_RDONLY))
        # Where the groups of CPU time are: of version 2, and of version 1.
        self._mounts: dict[str, str] = {}
        for line in self._read("/proc/mounts", -1).decode(errors="replace").splitlines():
            _, place, kind, options, *_ = line.split(" ")
            if kind == "cgroup2" or (kind == "cgroup" and "cpu" in options.split(",")):
                self._mounts.setdefault(kind, place)
        hostname = os.uname().nodename.encode()
        boot = self._read("/proc/sys/kernel/random/boot_id").strip()
        ticks, cpus = os.sysconf("SC_CLK_TCK"), os.cpu_count() or 1
        recorders = b"%d %d" % (os.getppid(), os.getpid())
        write(
            b"\t".join(
                (b"msgflow usage 1", _plain(hostname), boot, b"%d\t%d" % (ticks, cpus), recorders)
            )
        )

    def look(self, *, at_all: bool) -> None:
        """Look at the threads of traced processes, and at quotas; `look_at_all` may follow."""
        begin = time.monotonic_ns()
        self._write(b"look\t%d\t%b" % (begin, b"all" if at_all else b"threads"))
        for process in self._processes.values():
            for tid, thread in list(process.threads.items()):
                try:
                    self._look_at_thread(thread, begin, at_all=at_all)
                except (OSError, ValueError):
                    self._forget_thread(process, tid)
        for folder, cgroup in list(self._cgroups.items()):
            try:
                text = os.pread(cgroup.file, _MOST_BYTES, 0)
            except OSError:
                os.close(self._cgroups.pop(folder).file)
                continue
            throttled = b" ".join(line for line in text.splitlines() if b"throttled" in line)
            if throttled != cgroup.throttled:
                cgroup.throttled = throttled
                self._write(b"throttled\t%d\t%b" % (cgroup.number, throttled))

    def _look_at_thread(self, thread: _Thread, begin: int, *, at_all: bool) -> None:
        times = os.pread(thread.files[0], _MOST_BYTES, 0)
        at = time.monotonic_ns()
        # One that slept, and did not run, still sleeps, or waits for a CPU: that is seen later.
        if times == thread.last[0] and thread.last[1] == b"S" and not at_all:
            return
        stat = os.pread(thread.files[1], _MOST_BYTES, 0)
        # A name may have brackets.
        rest = stat.rindex(b") ") + 2
        last = times, stat[rest : rest + 1]
        if last != thread.last:
            thread.last = last
            fields = stat[rest:].split()
            running, waiting, _ = times.split()
            counts = (fields[0], running, waiting, fields[7], fields[9], fields[39])
            line = (b"run\t%d\t%d" % (thread.number, at - begin), *counts, thread.switches)
            self._write(b"\t".join(line))

    def look_at_all(self) -> None:
        """Look at all processes, at what they are, and at the machine."""
        pids = {name for name in os.listdir(f"{self._root}/proc") if name.isdecimal()}
        for pid in self._processes.keys() - pids:
            self._forget_process(pid)
        for pid in pids:
            # It may end meanwhile.
            try:
                self._look_at_process(pid)
            except (OSError, ValueError):
                self._forget_process(pid)
        for cgroup in self._cgroups.values():
            limit = b" ".join(
                word
                for name in ("cpu.max", "cpu.cfs_quota_us", "cpu.cfs_period_us")
                for word in self._read(f"{cgroup.folder}/{name}").split()
            )
            if limit != cgroup.limit:
                cgroup.limit = limit
                self._write(b"limit\t%d\t%b" % (cgroup.number, limit))
        for name, files in self._of_host.items():
            words = []
            for file in files:
                # A CPU may be off.
                with suppress(OSError):
                    words.append(os.pread(file, _MOST_BYTES, 0).partition(b"\n")[0])
            if words:
                self._write(b"host\t%b\t%b" % (name, b" ".join(words)))

    def _look_at_process(self, pid: str) -> None:
        process = self._processes.get(pid)
        if process is None:
            file = os.open(f"{self._root}/proc/{pid}/stat", os.O_RDONLY)
            process = self._processes[pid] = _Process(next(self._numbers), file)
        stat = os.pread(process.file, _MOST_BYTES, 0)
        if stat != process.last:
            self._note_change(pid, process, stat)
            process.last = stat
        if process.is_traced:
            self._look_for_threads(pid, process)

    def _note_change(self, pid: str, process: _Process, stat: bytes) -> None:
        end = stat.rindex(b") ")
        name = stat[stat.index(b"(") + 1 : end]
        fields = stat[end + 2 :].split(None, 21)
        if name != process.name:
            process.name = name
            command = self._read(f"/proc/{pid}/cmdline", _LONGEST_COMMAND).replace(b"\0", b" ")
            ids = b"%d\t%b\t%b" % (process.number, pid.encode(), fields[1])
            self._write(b"process\t%b\t%b\t%b" % (ids, _plain(name), _plain(command.strip())))
        ticks = int(fields[11]) + int(fields[12])
        if ticks != process.ticks:
            process.ticks = ticks
            self._write(b"cpu\t%d\t%d" % (process.number, ticks))
        # The library takes memory: where that is as before, none was loaded.
        if fields[20] != process.size and not process.is_traced:
            process.size = fields[20]
            process.is_traced = _LIBRARY in self._read(f"/proc/{pid}/maps", -1)

    def _look_for_threads(self, pid: str, process: _Process) -> None:
        tids = set(os.listdir(f"{self._root}/proc/{pid}/task"))
        for tid in process.threads.keys() - tids:
            self._forget_thread(process, tid)
        for tid in tids:
            # It may end meanwhile.
            with suppress(OSError):
                thread = process.threads.get(tid) or self._found(pid, tid, process)
                if thread.last != thread.at_status:
                    thread.at_status = thread.last
                    status = os.pread(thread.files[2], _MOST_BYTES, 0)
                    if switches := _SWITCHES.search(status):
                        thread.switches = b"\t".join(switches.groups())
        cgroups = self._read(f"/proc/{pid}/cgroup")
        if cgroups != process.cgroups:
            process.cgroups = cgroups
            for cgroup in self._cgroups_of(cgroups):
                self._write(b"member\t%d\t%d" % (process.number, cgroup.number))

    def _found(self, pid: str, tid: str, process: _Process) -> _Thread:
        """Open the files of a thread, and write what it is."""
        thread = _Thread(next(self._numbers), [])
        try:
            for name in ("schedstat", "stat", "status"):
                path = f"{self._root}/proc/{pid}/task/{tid}/{name}"
                thread.files.append(os.open(path, os.O_RDONLY))
            ids = _IDS.search(os.pread(thread.files[2], _MOST_BYTES, 0))
        except OSError:
            _close(thread)
            raise
        process.threads[tid] = thread
        # Of each namespace, the innermost last.
        of_both = ids.groups() if ids else (pid.encode(), tid.encode())
        words = (b" ".join(text.split()) for text in of_both)
        self._write(b"\t".join((b"thread\t%d\t%d" % (thread.number, process.number), *words)))
        return thread

    def _cgroups_of(self, text: bytes) -> list[_Cgroup]:
        """Return the groups that may hold a process up: its own, and those around it."""
        found = []
        for line in text.decode(errors="replace").splitlines():
            _, controllers, path = line.split(":", 2)
            if controllers and "cpu" not in controllers.split(","):
                continue
            mount = self._mounts.get("cgroup" if controllers else "cgroup2")
            own = PurePosixPath(path)
            # What is above the namespace of this process cannot be seen.
            if mount is None or ".." in own.parts:
                continue
            for name in map(str, (own, *own.parents)):
                with suppress(OSError):
                    found.append(self._cgroup(f"{mount}{name}".rstrip("/"), name))
        return found

    def _cgroup(self, folder: str, name: str) -> _Cgroup:
        cgroup = self._cgroups.get(folder)
        if cgroup is None:
            file = os.open(f"{self._root}{folder}/cpu.stat", os.O_RDONLY)
            cgroup = self._cgroups[folder] = _Cgroup(next(self._numbers), file, folder)
            self._write(b"cgroup\t%d\t%b" % (cgroup.number, _plain(os.fsencode(name))))
        return cgroup

    def _forget_thread(self, process: _Process, tid: str) -> None:
        thread = process.threads.pop(tid)
        _close(thread)
        self._write(b"gone\t%d" % thread.number)

    def _forget_process(self, pid: str) -> None:
        process = self._processes.pop(pid, None)
        if process is not None:
            for tid in list(process.threads):
                self._forget_thread(process, tid)
            os.close(process.file)

    def _read(self, path: str, size: int = _MOST_BYTES) -> bytes:
        """Return the begin of a file; nothing of one that may not be read, or is not there."""
        with suppress(OSError), open(self._root + path, "rb", buffering=0) as file:
            return file.read(size)
        return b""


def _close(thread: _Thread) -> None:
    for file in thread.files:
        os.close(file)


def _plain(text: bytes) -> bytes:
    return text.decode(errors="replace").translate(_CONTROLS).encode()


def main(path: str) -> None:
    """Sample until stdin ends, into a file."""
    # Each thread has three open files.
    _, most_files = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most_files, most_files))
    most_share = _MOST_SHARE * (os.cpu_count() or 1)
    lines: list[bytes] = []
    with gzip.open(path, "wb", compresslevel=1) as file:
        sampler = Sampler(lines.append)
        next_look = next_long_look = time.monotonic()
        is_over = False
        while not is_over:
            left = max(next_look - time.monotonic(), 0)
            is_over = bool(select.select([0], [], [], left)[0])
            begin, spent = time.monotonic(), time.process_time()
            is_long = is_over or begin >= next_long_look
            sampler.look(at_all=is_long)
            spent, before = time.process_time(), spent
            # A timer of the same period would be seen at the same place of it each time.
            pause = random.uniform(0.5 * _PERIOD, 1.5 * _PERIOD)
            next_look = begin + max(pause, (spent - before) / most_share)
            if is_long:
                sampler.look_at_all()
                file.write(b"".join(b"%b\n" % line for line in lines))
                file.flush()
                lines.clear()
                cost = time.process_time() - spent
                next_long_look = begin + max(_LONG_PERIOD, cost / most_share)


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except OSError as error:
        sys.stderr.write(f"{error.filename or sys.argv[1]}: {error.strerror or error}\n")
        sys.stderr.flush()
        # Nothing else is written, also not what gzip still has.
        os._exit(1)
