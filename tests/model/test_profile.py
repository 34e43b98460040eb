"""Samples of stacks: whose they are, when, and what perf's text of a stack says."""

from __future__ import annotations

import pytest
from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem
from support.staged_events import Source, Thread

MAIN = Thread(100)
HOG = "\t    11a8 hog (/lib/libhog.so)"
OF_CALLBACKS = """
SELECT s.at_ns, i.start_ns
FROM stack_sample AS s
LEFT JOIN callback_instance AS i USING (callback_instance_id)
ORDER BY s.at_ns
"""
STACKS = """
SELECT list(f.function || ' in ' || f.file ORDER BY c.position)
FROM stack_call AS c
JOIN stack_frame AS f USING (stack_frame_id)
GROUP BY c.stack_id
ORDER BY ALL
"""


def begin(system: RosSystem, callback: int, ts: int, thread: Thread = MAIN) -> None:
    system.add("ros2:callback_start", thread, ts=ts, callback=callback, is_intra_process=0)


def end(system: RosSystem, callback: int, ts: int, thread: Thread = MAIN) -> None:
    system.add("ros2:callback_end", thread, ts=ts, callback=callback)


def head(ns: int, pid: int = 100, tid: int = 100, event: str = "10101010 cpu-clock") -> str:
    return f"  {pid}/{tid}   [001] {ns // 10**9}.{ns % 10**9:09}:   {event}: "


def sampled(system: RosSystem, *moments: int, tid: int = 100) -> None:
    for moment in moments:
        system.add_sample(head(moment, tid=tid), HOG)


@pytest.fixture
def busy(system: RosSystem) -> RosSystem:
    """One callback from 2000 to 4000."""
    begin(system, 0xC1, 2_000)
    end(system, 0xC1, 4_000)
    return system


def test_a_sample_is_of_the_innermost_callback_of_its_thread(
    system: RosSystem, analyse: Analyse
) -> None:
    begin(system, 0xC1, 2_000)
    begin(system, 0xC2, 3_000)
    begin(system, 0xC3, 4_000)
    end(system, 0xC3, 5_000)
    end(system, 0xC2, 6_000)
    end(system, 0xC1, 7_000)
    system.node(MAIN, 0x1, "last")
    system.events[-1][1]["ts_ns"] = 9_000
    sampled(system, 2_000, 2_500, 3_500, 4_500, 5_500, 6_500, 7_000, 8_000)
    assert analyse(system).rows(OF_CALLBACKS) == [
        (2_000, 2_000),
        (2_500, 2_000),
        (3_500, 3_000),
        (4_500, 4_000),
        (5_500, 3_000),
        (6_500, 2_000),
        (7_000, None),
        (8_000, None),
    ]


def test_a_sample_of_another_thread_is_outside(busy: RosSystem, analyse: Analyse) -> None:
    """Also if that thread recorded nothing: then perf's number is all that is known of it."""
    busy.node(Thread(100, 101), 0x1, "other")
    busy.events[-1][1]["ts_ns"] = 2_100
    sampled(busy, 3_000, tid=101)
    sampled(busy, 3_001, tid=102)
    assert analyse(busy).rows(
        "SELECT s.tid, t.tid, callback_instance_id, p.pid, s.cpu, s.cpu_ns FROM stack_sample AS s "
        "JOIN process AS p USING (process_id) LEFT JOIN thread AS t USING (thread_id) ORDER BY 1"
    ) == [(101, 101, None, 100, 1, 10_101_010), (102, None, None, 100, 1, 10_101_010)]


def test_what_is_not_seen_to_end_lasts_until_the_next(system: RosSystem, analyse: Analyse) -> None:
    """Not where a gap may hide its end."""
    begin(system, 0xC1, 2_000)
    sampled(system, 3_000)
    system.add("ros2:rcl_publish", MAIN, ts=4_000, publisher_handle=0x10, message=0xA)
    assert analyse(system).rows(OF_CALLBACKS) == [(3_000, 2_000)]
    system.add_packet(0, 2_500, last_event=2_400, discarded=5)
    system.add_packet(2_500, 5_000)
    assert analyse(system).rows(OF_CALLBACKS) == [(3_000, None)]


def test_what_is_not_seen_to_end_is_over_when_the_executor_goes_on(
    system: RosSystem, analyse: Analyse
) -> None:
    begin(system, 0xC1, 2_000)
    system.ready(MAIN)
    system.events[-1][1]["ts_ns"] = 4_000
    system.node(MAIN, 0x1, "last")
    system.events[-1][1]["ts_ns"] = 9_000
    sampled(system, 3_000, 5_000)
    assert analyse(system).rows(OF_CALLBACKS) == [(3_000, 2_000), (5_000, None)]


def test_only_processes_of_the_recording_and_while_it_saw_them(
    busy: RosSystem, analyse: Analyse
) -> None:
    busy.add_sample(head(3_000, pid=7, tid=7), HOG)
    sampled(busy, 1_000, 3_000, 5_000)
    assert analyse(busy).rows(OF_CALLBACKS) == [(3_000, 2_000)]


def test_times_count_from_where_the_clock_of_the_traces_does(
    busy: RosSystem, analyse: Analyse
) -> None:
    """perf knows the machine by a name that a container need not have."""
    busy.sources[0] = Source(origin_ns=1_000)
    busy.add_sample(head(2_000), HOG)
    busy.add_sample(head(2_001), HOG, hostname="outside")
    busy.add_sample(head(2_002), HOG, is_monotonic=False)
    assert analyse(busy).rows(OF_CALLBACKS) == [(3_000, 2_000), (3_001, 2_000)]


def test_the_host_tells_of_which_clock_times_are(busy: RosSystem, analyse: Analyse) -> None:
    other = Thread(100, trace=1)
    busy.sources[1] = Source("beta", "other", origin_ns=500)
    begin(busy, 0xC1, 2_600, other)
    end(busy, 0xC1, 4_000, other)
    busy.add_sample(head(2_200), HOG, hostname="beta")
    busy.add_sample(head(2_200), HOG, hostname="none of both")
    model = analyse(busy)
    assert model.rows(OF_CALLBACKS) == [(2_700, 2_600)]
    assert details(model) == [
        "1 samples of functions are of a host of another name, and the traces have several clocks"
    ]


def test_a_pid_of_two_containers_is_of_neither(busy: RosSystem, analyse: Analyse) -> None:
    busy.sources[1] = Source("beta")
    other = Thread(100, trace=1)
    begin(busy, 0xC1, 2_000, other)
    end(busy, 0xC1, 4_000, other)
    busy.add_sample(head(3_000), HOG, hostname="machine")
    assert analyse(busy).rows(OF_CALLBACKS) == []
    busy.samples.clear()
    busy.add_sample(head(3_000), HOG)
    assert analyse(busy).rows(OF_CALLBACKS) == [(3_000, 2_000)]


def test_only_samples_of_time_count(busy: RosSystem, analyse: Analyse) -> None:
    for number, event in enumerate(("1 cycles:u", "1 cache-misses", "1 sched:sched_switch", "")):
        busy.add_sample(head(3_000 + number, event=event), HOG)
    busy.add_sample("no sample at all", HOG)
    busy.add_sample("python  9 100/100 3.000000:  7 task-clock:  11a8 hog (/lib/libhog.so)")
    busy.add_sample("0/99999999999999999999 [0] 3.000000: 7 cpu-clock: 1 a (/b)")
    busy.sources[0] = Source(origin_ns=3_000 - 3 * 10**9)
    busy.samples[:-2] = [
        (host, known, line.replace(" 0.00000", " 3.00000").replace("3.000003", "3.000000"), stack)
        for host, known, line, stack in busy.samples[:-2]
    ]
    assert analyse(busy).rows("SELECT cpu_ns FROM stack_sample ORDER BY 1") == [(7,), (None,)]


def stacks_of(busy: RosSystem, analyse: Analyse, *lines: str) -> list[tuple[list[str]]]:
    busy.add_sample(head(3_000), *lines)
    return analyse(busy).rows(STACKS)


def test_calls_are_from_the_outermost_to_what_ran(busy: RosSystem, analyse: Analyse) -> None:
    lines = (
        "\tffffffff816 do_syscall_64 ([kernel.kallsyms])",
        "\t  11a8 Foo::operator() (int) (/opt/ros/lib (x86)/libfoo.so)",
        "\t  99 py::Node.tick:/src/a:b.py (/tmp/perf-100.map)",
        "\t  98 py::detail::call:once (/usr/lib/libpybind.so)",
        "\t  22 [unknown] (/opt/lib/libbar.so (deleted))",
        "\t  not a line of a stack",
    )
    assert stacks_of(busy, analyse, *lines) == [
        (
            [
                "[unknown] in /opt/lib/libbar.so (deleted)",
                "py::detail::call:once in /usr/lib/libpybind.so",
                "Node.tick in /src/a:b.py",
                "Foo::operator() (int) in /opt/ros/lib (x86)/libfoo.so",
                "do_syscall_64 in [kernel.kallsyms]",
            ],
        )
    ]


def test_what_is_no_code_ends_a_stack(busy: RosSystem, analyse: Analyse) -> None:
    """What ran is kept all the same."""
    lost = "\t7ffd92835a60 [unknown] ([unknown])"
    assert stacks_of(busy, analyse, HOG, lost, "\t 1 main (/bin/a)") == [
        (["hog in /lib/libhog.so"],)
    ]
    busy.samples.clear()
    assert stacks_of(busy, analyse, lost, HOG) == [
        (["hog in /lib/libhog.so", "[unknown] in [unknown]"],)
    ]


PYTHON = "\t 99 py::hog_60:/src/robot.py (/tmp/perf-100.map)"
LOOP = "\t 1 _PyEval_EvalFrameDefault (/usr/lib/libpython3.12.so.1.0)"


@pytest.mark.parametrize(
    ("lines", "ran"),
    [
        ([PYTHON], "hog_60"),
        ([LOOP, PYTHON], "hog_60"),
        (["\t 1 [unknown] (/usr/bin/python3.12)", PYTHON, LOOP], "hog_60"),
        (
            ["\t f do_syscall_64 ([kernel.kallsyms])", "\t 1 read (/lib/libc.so.6)", PYTHON],
            "hog_60",
        ),
        (["\t 1 __vdso_clock_gettime ([vdso])", LOOP, PYTHON], "hog_60"),
        (["\t f uvc_ioctl ([uvcvideo])", "\t f ksys_ioctl ([kernel.kallsyms])", PYTHON], "hog_60"),
        (["\t 1 memcpy (/lib/libc-2.31.so)", LOOP, PYTHON], "hog_60"),
        (["\t 1 lock (/lib/libpthread-2.31.so)", LOOP, PYTHON], "hog_60"),
        (["\t 1 mail_open (/usr/lib/libc-client.so.2007e)", LOOP, PYTHON], "mail_open"),
        (["\t 1 __tls_get_addr (/usr/lib/ld-linux-x86-64.so.2)", LOOP, PYTHON], "hog_60"),
        (["\t 1 capture (/usr/lib/libcamera.so.0.3)", LOOP, PYTHON], "capture"),
        ([LOOP, PYTHON, LOOP, PYTHON.replace("hog_60", "outer")], "hog_60"),
        (["\t 1 dot (/lib/numpy/core/_umath.so)", LOOP, PYTHON], "dot"),
        (["\t f read ([kernel.kallsyms])", "\t 1 write (/lib/libddsc.so)", PYTHON], "read"),
        (["\t 1 [unknown] ([unknown])", PYTHON], "[unknown]"),
        ([LOOP, "\t 1 main (/usr/bin/python3.12)"], "_PyEval_EvalFrameDefault"),
        ([LOOP, "\t 1 [unknown] ([unknown])", PYTHON], "_PyEval_EvalFrameDefault"),
        (["\t 1 py::call:x (/usr/lib/libpython3.12.so.1.0)", LOOP], "py::call:x"),
    ],
)
def test_what_the_interpreter_does_for_a_function_of_python_that_function_does(
    busy: RosSystem, analyse: Analyse, lines: list[str], ran: str
) -> None:
    """Functions of other libraries stand for themselves; no call is left out of the stack."""
    busy.add_sample(head(3_000), *lines)
    model = analyse(busy)
    assert model.column("FROM stack JOIN stack_frame USING (stack_frame_id) SELECT function") == [
        ran
    ]
    kept = next((at for at, line in enumerate(lines) if at and "([unknown])" in line), len(lines))
    assert model.column("SELECT depth FROM stack") == [kept]


def test_each_stack_is_stored_once(busy: RosSystem, analyse: Analyse) -> None:
    """Addresses in a function do not tell stacks apart."""
    for number in range(3):
        busy.add_sample(
            head(3_000 + number), f"\t 11a{number} hog (/a)", "\t 1 hog (/a)", "\t 1 main (/b)"
        )
    model = analyse(busy)
    rows = model.rows("SELECT depth, function FROM stack JOIN stack_frame USING (stack_frame_id)")
    assert rows == [(3, "hog")]
    assert model.value("SELECT count(*) FROM stack_frame") == 2
    assert model.value("SELECT count(DISTINCT stack_id) FROM stack_sample") == 1


def details(model: Analysis) -> list[str]:
    return model.column("SELECT detail FROM store.finding WHERE name LIKE 'samples_%' ORDER BY ALL")


def test_what_does_not_fit_is_said(busy: RosSystem, analyse: Analyse) -> None:
    busy.add_sample(head(3_000), HOG, is_monotonic=False)
    busy.add_sample(head(3_000, pid=7), HOG)
    assert details(analyse(busy)) == [
        "1 samples of functions have times of another clock, or no time",
        "none of 1 samples of functions is of a process that recorded events",
    ]
    busy.samples.clear()
    for _ in range(9):
        busy.add_sample(head(3_000), HOG)
    busy.add_sample(head(3_000), "\t 1 [unknown] (/lib/x.so)", "\t 1 [unknown] ([unknown])")
    assert details(analyse(busy)) == [
        "1 of 10 samples do not name the function, most of them in /lib/x.so",
        "1 of 10 samples do not show all callers",
    ]
