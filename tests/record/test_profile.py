"""Samples of functions beside a recording: what is said before it, and shares that are known."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from msgflow import Database, UsageError
from msgflow.record import perf
from msgflow.record.perf import Rate, read_rate, recorded_samples
from msgflow.record.program import with_python_functions
from msgflow.trace.perf_script import TEXT

HOGS = """
#include <time.h>
namespace {
double now() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return t.tv_sec + t.tv_nsec * 1e-9;
}
volatile long sink;
template <int percent> __attribute__((noinline)) void hog(double seconds) {
  for (double end = now() + seconds * percent / 100; now() < end;)
    for (int i = 0; i < 20000; i++) sink = sink + i;
}
}
extern "C" __attribute__((noinline)) void detect(double seconds) {
  hog<10>(seconds);
  hog<30>(seconds);
  hog<60>(seconds);
  sink = 0;
}
extern "C" __attribute__((noinline)) void look(double seconds) { hog<100>(seconds); sink = 0; }
"""
NODES = """
import ctypes, sys
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import UInt64

hogs = ctypes.CDLL(sys.argv[1])
hogs.detect.argtypes = hogs.look.argtypes = [ctypes.c_double]
rclpy.init()
camera, detector = Node("camera"), Node("detector")
image = camera.create_publisher(UInt64, "/image", 10)
detector.create_subscription(UInt64, "/image", lambda message: hogs.detect(0.06), 10)
camera.create_timer(0.1, lambda: (hogs.look(0.01), image.publish(UInt64())))
executor = rclpy.executors.SingleThreadedExecutor()
executor.add_node(camera)
executor.add_node(detector)
try:
    executor.spin()
except (ExternalShutdownException, KeyboardInterrupt):
    pass
"""
# Each computes in its own frame: without frame pointers only the innermost function has a name.
HOG = """
def {name}(seconds):
    end = time.thread_time() + seconds * {share}
    while time.thread_time() < end:
        for number in range(500):
            number * number
"""
SLOW_PERF = """#!{python}
import os, pathlib, signal, sys, time
(control,) = [word for word in sys.argv if word.startswith("--control=fd:")]
place = int(control.rpartition(",")[2])
time.sleep(0.3)
pathlib.Path("{place}", os.read(place, 100).decode().strip()).touch()
os.write(place, b"ack")
signal.pause()
"""
SHARES = {"hog<10>": 0.1, "hog<30>": 0.3, "hog<60>": 0.6}
PYTHON_SHARES = {"hog_10": 0.1, "hog_30": 0.3, "hog_60": 0.6}


def test_a_rate_may_say_how_callers_are_found() -> None:
    assert read_rate("99") == Rate(99, "fp")
    assert read_rate("49:dwarf") == Rate(49, "dwarf")
    for text in ("", "0", "fast", "99:lbr", "20000"):
        with pytest.raises(UsageError, match="no rate of samples"):
            read_rate(text)


@pytest.mark.parametrize(
    ("script", "said"),
    [
        (None, "perf is not installed (apt-get install linux-perf)"),
        ("echo Access to performance monitoring is limited >&2; exit 1", "perf may not: Access"),
    ],
)
def test_what_is_missing_is_said_before_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str | None, said: str
) -> None:
    if script is not None:
        (tmp_path / "perf").write_text(f"#!/bin/sh\n{script}\n")
        (tmp_path / "perf").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    notes: list[str] = []
    with recorded_samples(tmp_path, Rate(99, "fp"), is_ours=True, note=notes.append):
        (note,) = notes
    assert said in note
    assert "sysctl kernel.perf_event_paranoid=1" in note
    assert not (tmp_path / TEXT).exists()


def test_a_recording_begins_when_perf_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else nothing is known of a program that starts before: perf samples what comes later."""
    (tmp_path / "perf").write_text(SLOW_PERF.format(python=sys.executable, place=tmp_path))
    (tmp_path / "perf").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    with perf.recorded(tmp_path / "data", [], note=pytest.fail):
        assert (tmp_path / "enable").exists()


def test_python_is_asked_to_name_its_functions(tmp_path: Path) -> None:
    """Whether it can is asked of the Python that the command runs, where that is known."""
    environment = {"PATH": str(tmp_path)}
    notes: list[str] = []

    def program(name: str, text: str) -> str:
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
        return str(tmp_path / name)

    def said(*words: str) -> list[str]:
        notes.clear()
        found = with_python_functions(words, environment, notes.append)
        assert found == environment | {"PYTHONPERFSUPPORT": "1"}
        return notes

    old = program("python3", "#!/bin/sh\nexit 12\n")
    program("python3.9", "#!/bin/sh\nexit 3\n")
    program("python3.13", "#!/bin/sh\nexit 0\n")
    (note,) = said("python3", "robot.py")
    assert f"{old} is older than 3.12" in note
    (note,) = said(str(tmp_path / "python3.9"), "robot.py")
    assert "does not run (exit code 3)" in note
    assert not said("python3.13", "robot.py")
    for line in (f"#!{old}", "#!/usr/bin/env python3", f"#! {old} -sP"):
        (note,) = said(program("ros2", line + "\nimport ros2cli\n"), "launch")
        assert "is older than 3.12" in note
    assert not said(program("ros2", "#!/usr/bin/env python3.13\n"))
    # Nothing is known of others; none of them is executed.
    for text in ("\x7fELF python3", "", "python3", "#!/bin/sh\npython3 robot.py\n"):
        assert not said(program("robot", text))
    assert not said(program("python_robot", f"#!/bin/sh\ntouch {tmp_path}/executed\nexit 12\n"))
    assert not said("absent")
    assert not (tmp_path / "executed").exists()
    # One that the system cannot execute ends no recording.
    program("python3.14", "no program")
    assert not said("python3.14", "robot.py")


@pytest.mark.thorough
def test_shares_of_known_functions(robot: list[str], tmp_path: Path) -> None:
    """Within 5 points at 400 samples; nothing of a callback is of another one."""
    if reason := perf.why_not(["--event=cpu-clock"]):
        pytest.skip(reason)
    (tmp_path / "hogs.cpp").write_text(HOGS)
    flags = ["-O1", "-g", "-fno-omit-frame-pointer", "-fno-optimize-sibling-calls"]
    subprocess.run(
        ["g++", *flags, "-shared", "-fPIC", "hogs.cpp", "-o", "libhogs.so"],
        cwd=tmp_path,
        check=True,
    )
    command = [sys.executable, "-m", "msgflow", "record", "--profile", "199", "--duration", "14"]
    program = [*robot[: robot.index("-c")], "-c", NODES, str(tmp_path / "libhogs.so")]
    subprocess.run(
        [*command, "-o", "trace", "--", *program],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        env=os.environ,
    )
    names = sorted(path.name for path in (tmp_path / "trace").iterdir())
    assert names == ["cpu", TEXT, "usage.gz", "ust"]
    with Database(tmp_path / "msgflow.duckdb") as database:
        rows = database.query("functions").to_arrow().to_pylist()
        why = database.why()
    of_hogs = [row for row in rows if "hog<" in row["function"]]
    found = {
        (row["callback"], row["function"][row["function"].index("hog<") :][:7]): row
        for row in of_hogs
    }
    assert {function for callback, function in found if "/image" in callback} == set(SHARES)
    assert {function for callback, function in found if "Timer" in callback} == {"hog<100"}
    assert {callback for callback, _ in found} == {"Subscription(/image)", "Timer(100 ms)"}
    shares = {row["function"]: row["total_share"] for row in of_hogs}
    samples = sum(row["samples"] for row in of_hogs if "/image" in row["callback"])
    for function, share in SHARES.items():
        row = found["Subscription(/image)", function]
        assert abs(row["total_share"] - share) < (0.05 if samples >= 400 else 0.1), shares
    assert any("hog<60>" in note for note in why.notes)


@pytest.mark.thorough
def test_shares_of_known_functions_of_python(robot: list[str], tmp_path: Path) -> None:
    """The same, from Python 3.12 on, of the samples whose stack leads to a function of Python."""
    if reason := perf.why_not(["--event=cpu-clock"]):
        pytest.skip(reason)
    python = Path(robot[robot.index("-c") - 1])
    names = "import sys; sys.exit(not hasattr(sys, 'activate_stack_trampoline'))"
    if subprocess.run([python, "-c", names]).returncode:
        pytest.skip(f"{python} is older than 3.12")
    # Where a process becomes another program of the same libraries, perf may take the old places of
    # these for the new ones: so Python, which the wheels start anew to set this, has it from the
    # start, and all programs have the same places (setarch).
    folders = [python.parents[1] / "lib", *python.parents[1].glob("lib/python3*/*/ros_*.libs")]
    libraries = os.pathsep.join(map(str, folders))
    whole = [f"LD_LIBRARY_PATH={libraries}", "_ROS_WHEELS_BOOTSTRAP_COMPLETE=1", str(python)]
    of_hogs = {**PYTHON_SHARES, "look": 1.0}
    hogs = "".join(HOG.format(name=name, share=share) for name, share in of_hogs.items())
    calls = ", ".join(f"{name}(0.06)" for name in PYTHON_SHARES)
    nodes = (
        NODES.replace("import ctypes, sys", f"import time\n{hogs}")
        .replace("hogs.detect(0.06)", f"({calls})")
        .replace("hogs.look", "look")
    )
    (tmp_path / "robot.py").write_text(
        "".join(line for line in nodes.splitlines(keepends=True) if not line.startswith("hogs"))
    )
    command = ["setarch", "-R", sys.executable, "-m", "msgflow", "record", "--profile", "99:dwarf"]
    program = [*robot[: robot.index(str(python))], *whole, str(tmp_path / "robot.py")]
    subprocess.run(
        [*command, "--duration", "25", "-o", "trace", "--", *program],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        env=os.environ,
    )
    with Database(tmp_path / "msgflow.duckdb") as database:
        rows = database.query("functions").to_arrow().to_pylist()
        why = database.why()
    found = {(row["callback"], row["function"]): row for row in rows if row["function"] in of_hogs}
    assert found.keys() == {
        ("Timer(100 ms)", "look"),
        *(("Subscription(/image)", name) for name in PYTHON_SHARES),
    }
    assert {Path(row["file"]).name for row in found.values()} == {"robot.py"}
    assert sum(found["Subscription(/image)", name]["self_share"] for name in PYTHON_SHARES) > 0.7
    assert any("Subscription(/image): hog_60 " in note for note in why.notes), why.notes
    counts = {name: found["Subscription(/image)", name]["samples"] for name in PYTHON_SHARES}
    samples = sum(counts.values())
    for name, share in PYTHON_SHARES.items():
        assert abs(counts[name] / samples - share) < (0.05 if samples >= 400 else 0.1), counts
