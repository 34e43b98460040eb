"""Samples of the system: whose they are, and what threads, programs and quotas did between two."""

from __future__ import annotations

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Source, Thread

MAIN = Thread(100)
MS = 10**6
THREADS = """
SELECT t.tid, u.start_ns // 1000000, u.end_ns // 1000000, u.running_ns, u.waiting_ns, u.state
FROM thread_usage AS u
JOIN thread AS t USING (thread_id)
ORDER BY ALL
"""
PROGRAMS = """
SELECT name, pid, start_ns // 1000000, end_ns // 1000000, cpu_ns // 1000000, is_recorder
FROM program_usage
ORDER BY ALL
"""
QUOTAS = """
SELECT name, start_ns // 1000000, end_ns // 1000000, throttled_count, throttled_ns, cpus
FROM quota_usage
ORDER BY ALL
"""
FINDING = "SELECT subject, detail FROM finding WHERE name = 'usage_left_out' ORDER BY ALL"
TALKER = ("process 1 5000 1 talker talker+--fast", "thread 2 1 5000+100 5000+100")

OTHER = "thread\t4\t", "run\t4\t"


def look(ms: int, *, all: bool = False) -> str:
    return f"look {ms * MS} {'all' if all else 'threads'}"


def run(running: int, waiting: int, state: str = "S", thread: int = 2, at: int = 0) -> str:
    return f"run {thread} {at} {state} {running} {waiting} 0 0 0 0 0"


def lived(system: RosSystem, thread: Thread = MAIN, first: int = 900, last: int = 1900) -> None:
    for ms in (first, last):
        system.add("ros2:rcl_publish", thread, ts=ms * MS, publisher_handle=0x10, message=0xA)


@pytest.fixture
def sampled(system: RosSystem) -> RosSystem:
    """A thread that is known from 1 s on."""
    lived(system)
    system.add_usage(look(1000, all=True), *TALKER, run(5, 7))
    return system


def test_silence_says_that_nothing_changed(sampled: RosSystem, analyse: Analyse) -> None:
    sampled.add_usage(look(1100), look(1200), look(1300), run(35, 27, "R"), look(1400))
    assert analyse(sampled).rows(THREADS) == [
        (100, 1000, 1200, 0, 0, "S"),
        (100, 1200, 1300, 30, 20, "R"),
        (100, 1300, 1400, 0, 0, "R"),
    ]


def test_a_row_ends_when_its_thread_was_read(sampled: RosSystem, analyse: Analyse) -> None:
    sampled.add_usage(look(1100), run(35, 27, at=3 * MS), look(1200), "gone 2", look(1300))
    assert analyse(sampled).rows(THREADS) == [
        (100, 1000, 1103, 30, 20, "S"),
        (100, 1103, 1200, 0, 0, "S"),
    ]


@pytest.mark.parametrize(("running", "is_longer"), [(40 * MS, False), (40 * MS + 1, True)])
def test_a_wait_that_is_longer_than_its_look_began_before(
    sampled: RosSystem, analyse: Analyse, running: int, is_longer: bool
) -> None:
    """What a look between saw of its state begins no row."""
    sampled.add_usage(look(1100), look(1200), run(5, 7, "R"), look(1300))
    sampled.add_usage(run(5 + running, 7 + 60 * MS, "D"))
    expected = [(100, 1000, 1300, running, 60 * MS, "D")]
    if not is_longer:
        expected = [(100, 1000, 1200, 0, 0, "R"), (100, 1200, 1300, running, 60 * MS, "D")]
    assert analyse(sampled).rows(THREADS) == expected


def test_no_thread_does_more_than_there_is_time(sampled: RosSystem, analyse: Analyse) -> None:
    sampled.add_usage(
        look(1100), run(90 * MS + 5, 70 * MS + 7), look(1200), run(900 * MS, 900 * MS)
    )
    assert analyse(sampled).rows(THREADS) == [
        (100, 1000, 1100, 90 * MS, 10 * MS, "S"),
        (100, 1100, 1200, 100 * MS, 0, "S"),
    ]


@pytest.mark.parametrize(
    "line", [run(4, 70), run(50, 6), run(-5, 70), run(10**19, 70), "run 2 0 S"]
)
def test_counters_that_fall_or_make_no_sense_say_nothing(
    sampled: RosSystem, analyse: Analyse, line: str
) -> None:
    sampled.add_usage(look(1100), line, look(1200), run(100, 80), look(1300), run(101, 81))
    rows = analyse(sampled).rows(THREADS)
    assert (100, 1200, 1300, 1, 1, "S") in rows
    assert not any(end == 1100 for _, _, end, *_ in rows)


def test_counts_of_a_row(sampled: RosSystem, analyse: Analyse) -> None:
    sampled.add_usage(look(1100), "run 2 0 R 6 7 3 2 4 5 6")
    sampled.add_usage(look(1200), "run 2 0 R 7 7 13 22 34 45 56")
    assert analyse(sampled).rows(
        "SELECT minor_faults, major_faults, io_ns, voluntary_switches, forced_switches "
        "FROM thread_usage ORDER BY start_ns"
    ) == [(3, 2, 40 * MS, 5, 6), (10, 20, 300 * MS, 40, 50)]


def test_a_thread_is_known_by_its_ids_in_its_container(
    sampled: RosSystem, analyse: Analyse
) -> None:
    """Where two containers number alike at one time, nothing tells whose it is."""
    sampled.add_usage("process 3 6000 1 other", "thread 4 3 6000+100 6000+100", run(1, 1, thread=4))
    sampled.add_usage(look(1100), run(15, 17), run(9, 9, thread=4))
    assert analyse(sampled).rows(THREADS) == []
    sampled.usage = [line for line in sampled.usage if not line[-1].startswith(OTHER)]
    sampled.add_usage(look(1200), "gone 2", look(1300), "thread 4 3 6000+100 6000+100")
    sampled.add_usage(run(1, 1, thread=4), look(1400), run(9, 9, thread=4))
    assert analyse(sampled).rows(THREADS) == [
        (100, 1000, 1100, 10, 10, "S"),
        (100, 1100, 1200, 0, 0, "S"),
        (100, 1300, 1400, 8, 8, "S"),
    ]


def test_a_thread_is_of_the_life_of_its_process_that_it_was_seen_in(
    sampled: RosSystem, analyse: Analyse
) -> None:
    """A process of another time has the same ids."""
    sampled.events.clear()
    lived(sampled, first=100, last=999)
    sampled.add_usage(look(1100), run(15, 17))
    assert analyse(sampled).rows(THREADS) == []


def test_the_boot_tells_of_which_machine_samples_are(sampled: RosSystem, analyse: Analyse) -> None:
    """Their times count from where its clock does; a name alone may be that of two machines."""
    sampled.sources = {0: Source("alpha", "one"), 1: Source("alpha", "two", origin_ns=500 * MS)}
    lived(sampled, Thread(100, trace=1))
    sampled.usage.clear()
    lines = (look(1000, all=True), *TALKER, run(5, 7), look(1100), run(15, 17))
    sampled.add_usage(*lines, boot="two")
    assert analyse(sampled).rows(THREADS) == [(100, 1500, 1600, 10, 10, "S")]
    sampled.usage.clear()
    sampled.add_usage(*lines, boot="another", hostname="beta")
    model = analyse(sampled)
    assert model.rows(THREADS) == []
    assert model.rows(FINDING) == [
        ("beta", "4 samples of the system are of another machine or boot than the traces")
    ]


def test_the_name_tells_containers_of_one_machine_apart(
    sampled: RosSystem, analyse: Analyse
) -> None:
    """One that no trace has is that of the machine around them."""
    sampled.sources[1] = Source("beta")
    lived(sampled, Thread(100, trace=1))
    sampled.add_usage(look(1100), run(15, 17))
    assert analyse(sampled).rows(THREADS) == [(100, 1000, 1100, 10, 10, "S")]
    sampled.usage = [(file, "machine", *rest) for file, _, *rest in sampled.usage]
    assert analyse(sampled).rows(THREADS) == []


def test_times_that_go_back_say_nothing(sampled: RosSystem, analyse: Analyse) -> None:
    sampled.add_usage(look(1100), run(15, 17), look(1050), run(16, 17), look(1100), run(17, 17))
    sampled.add_usage(look(1200), run(18, 17))
    model = analyse(sampled)
    assert model.rows(THREADS) == [
        (100, 1000, 1100, 10, 10, "S"),
        (100, 1100, 1200, 3, 0, "S"),
    ]
    assert model.rows(FINDING) == [
        ("alpha", "2 of 7 samples of the system make no sense, or their times go back")
    ]


def test_cpu_time_of_programs(sampled: RosSystem, analyse: Analyse) -> None:
    """Of what began between two looks, all counts; the first look at all tells nothing."""
    sampled.add_usage("cpu 1 300", "process 3 4712 4711 python sampler", "cpu 3 1")
    sampled.add_usage("process 5 60 1 lttng-consumerd", "process 6 61 4711 perf", "cpu 6 1")
    sampled.add_usage(
        look(1100), look(2000, all=True), "cpu 1 350", "cpu 3 2", "cpu 5 1", "cpu 6 2"
    )
    sampled.add_usage("process 7 62 1 perf", "cpu 7 4", "process 8 63 1 hog", "cpu 8 999")
    sampled.add_usage(look(3000, all=True), "cpu 1 340", "cpu 8 1009")
    model = analyse(sampled)
    assert model.rows(PROGRAMS) == [
        ("hog", 63, 1000, 2000, 2000, False),
        ("hog", 63, 2000, 3000, 100, False),
        ("lttng-consumerd", 60, 1000, 2000, 10, True),
        ("perf", 61, 1000, 2000, 10, True),
        ("perf", 62, 1000, 2000, 40, False),
        ("python", 4712, 1000, 2000, 10, True),
        ("talker", 5000, 1000, 2000, 500, False),
    ]
    assert model.rows(
        "SELECT p.pid, command FROM program_usage LEFT JOIN process AS p USING (process_id) "
        "WHERE p.pid IS NOT NULL OR command = 'sampler' ORDER BY 1"
    ) == [(100, "talker --fast"), (None, "sampler")]


def test_quotas_of_both_kinds(sampled: RosSystem, analyse: Analyse) -> None:
    """Only those that processes of the recording are in; the limit is that of the time."""
    sampled.add_usage("cgroup 10 /robot", "cgroup 11 /docker/a", "cgroup 12 /other", "member 1 10")
    sampled.add_usage("member 1 11", "limit 10 max+100000", "limit 11 50000+100000")
    sampled.add_usage(*(f"throttled {group} nr_throttled+1+throttled_usec+5" for group in (10, 12)))
    sampled.add_usage("throttled 11 nr_throttled+1+throttled_time+5")
    sampled.add_usage(look(1100), "throttled 10 nr_throttled+3+throttled_usec+9")
    sampled.add_usage("throttled 11 nr_throttled+1+throttled_time+8", "limit 11 -1+100000")
    sampled.add_usage(look(1200), "throttled 11 nr_throttled+2+throttled_time+9", look(1300))
    sampled.add_usage("throttled 11 nr_throttled+1+throttled_time+10")
    assert analyse(sampled).rows(QUOTAS) == [
        ("/docker/a", 1000, 1100, 0, 3, 0.5),
        ("/docker/a", 1100, 1200, 1, 1, None),
        ("/robot", 1000, 1100, 2, 4000, None),
    ]


def test_how_busy_a_host_was(sampled: RosSystem, analyse: Analyse) -> None:
    first = ("cpu cpu++10+20+30+400+50+6+7+8+0+0", "cpu_pressure some+avg10=0.10+total=7")
    sampled.add_usage(*(f"host {line}" for line in first), "host throttling 1+2")
    then = ("cpu cpu++11+22+34+999+99+14+23+40+0+0", "cpu_pressure some+avg10=9.99+total=9")
    sampled.add_usage(look(1100), look(2000, all=True), *(f"host {line}" for line in then))
    sampled.add_usage("host frequency 600000+1800000", "host most_frequency 2000000")
    sampled.add_usage("host throttling 4+3", look(3000, all=True), "host throttling 4+2")
    assert analyse(sampled).rows(
        "SELECT start_ns // 1000000, end_ns // 1000000, cpus, busy_ns // 1000000, "
        "stolen_ns // 1000000, cpu_pressure_ns, io_pressure_ns, frequency_hz, most_frequency_hz, "
        "throttle_count FROM host_usage ORDER BY 1"
    ) == [
        (1000, 2000, 2, 310, 320, 2000, None, 1_200_000_000, 2_000_000_000, 4),
        (2000, 3000, 2, None, None, None, None, None, None, None),
    ]


@pytest.mark.parametrize("word", ["", "-1", "9" * 15, "9" * 19, "9" * 400, "1e400", "nan", "'"])
def test_any_word_may_stand_anywhere(sampled: RosSystem, analyse: Analyse, word: str) -> None:
    sampled.add_usage("cgroup 10 /robot", "member 1 10", look(1100, all=True))
    lines = (
        f"look {word} all",
        f"process {word} {word} {word} {word}",
        f"thread {word} {word} {word} {word}",
        f"thread 2 {word} {word} {word}",
        f"run {word} {word} {word} {word} {word} {word} {word} {word} {word} {word}",
        f"run 2 {word} {word} {word} {word} {word} {word} {word} {word} {word}",
        f"cpu {word} {word}",
        f"cpu 1 {word}",
        f"member {word} {word}",
        f"limit 10 {word}+{word}",
        f"throttled 10 nr_throttled+{word}+throttled_usec+{word}+throttled_time+{word}",
        f"host cpu cpu+{'+'.join([word] * 10)}",
        f"host cpu_pressure total={word}",
        f"host frequency {word}",
        f"host most_frequency {word}",
        f"host throttling {word}+{word}",
        f"host {word}",
        f"{word}",
    )
    for number, line in enumerate(lines):
        sampled.add_usage(line, look(1200 + number, all=True))
    sampled.add_usage(*lines)
    sampled.add_usage(*lines, file=1, hostname=word, boot=word)
    model = analyse(sampled)
    for table in ("thread_usage", "program_usage", "quota_usage", "host_usage"):
        model.rows(f"SELECT * FROM {table}")
    assert model.rows(FINDING)


def test_without_samples_nothing_is_said(system: RosSystem, analyse: Analyse) -> None:
    lived(system)
    model = analyse(system)
    assert model.rows(THREADS) == []
    assert model.rows(FINDING) == []


def test_samples_of_no_process_of_the_recording(system: RosSystem, analyse: Analyse) -> None:
    lived(system, Thread(7))
    system.add_usage(look(1000, all=True), *TALKER, run(5, 7))
    assert analyse(system).rows(FINDING) == [
        ("alpha", "none of 1 threads that were sampled recorded events")
    ]


def test_files_of_several_hosts_number_alike(system: RosSystem, analyse: Analyse) -> None:
    """What one of them says is of its host alone."""
    system.sources[1] = Source("beta", "two")
    lived(system)
    lived(system, Thread(100, trace=1))
    for file, hostname in enumerate(("alpha", "beta")):
        ms = 10 + 5 * file
        lines = (
            *(look(1000, all=True), *TALKER, run(5, 7), "cpu 1 1", "cgroup 10 /robot"),
            *("member 1 10", f"limit 10 {ms}+100", "throttled 10 nr_throttled+1+throttled_time+5"),
            *("host cpu_pressure total=7", look(1000 + ms), run(15 + file, 27 + file)),
            *(f"throttled 10 nr_throttled+{2 + file}+throttled_time+6", "gone 2"),
            *(look(2000, all=True), f"cpu 1 {3 + file}", f"host cpu_pressure total={9 + file}"),
        )
        system.add_usage(*lines, file=file, hostname=hostname)
    model = analyse(system)
    of_host = "JOIN host AS h USING (host_id) ORDER BY ALL"
    assert model.rows(
        "SELECT h.hostname, u.end_ns - u.start_ns, u.running_ns, u.waiting_ns "
        "FROM thread_usage AS u JOIN thread USING (thread_id) "
        f"JOIN process USING (process_id) {of_host}"
    ) == [("alpha", 10 * MS, 10, 20), ("beta", 15 * MS, 11, 21)]
    assert model.rows(
        f"SELECT h.hostname, u.cpu_ns, u.process_id FROM program_usage AS u {of_host}"
    ) == [("alpha", 20 * MS, 1), ("beta", 30 * MS, 2)]
    assert model.rows(
        "SELECT h.hostname, u.process_id, u.end_ns - u.start_ns, throttled_count, cpus "
        f"FROM quota_usage AS u {of_host}"
    ) == [("alpha", 1, 10 * MS, 1, 0.1), ("beta", 2, 15 * MS, 2, 0.15)]
    assert model.rows(f"SELECT h.hostname, cpu_pressure_ns FROM host_usage AS u {of_host}") == [
        ("alpha", 2000),
        ("beta", 3000),
    ]
