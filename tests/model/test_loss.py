"""Gaps of the traces, read from their packets."""

from __future__ import annotations

import pytest
from support.analysis import Analyse, Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread

MS = 1_000_000
GAPS = "SELECT kind, cpu, start_ns, end_ns, event_count FROM gap ORDER BY start_ns, cpu"
Gaps = list[tuple[str, int | None, int, int, int | None]]


def alone(system: RosSystem, trace: int, path: str | None = None) -> None:
    """This trace is of a host of its own: several systems side by side."""
    system.add_source(trace, f"host {trace}", f"boot {trace}", path=path)


def gaps_of(model: Analysis, trace: int) -> Gaps:
    """What GAPS says, of one of several traces."""
    return model.rows(GAPS.replace("ORDER", f"WHERE trace_id = {trace + 1} ORDER"))


def test_continuous_packets_have_no_gap(system: RosSystem, analyse: Analyse) -> None:
    for cpu in (0, 1):
        for begin in (0, 100, 200):
            system.add_packet(begin, begin + 100, cpu=cpu)
    assert analyse(system).rows(GAPS) == []


def test_events_are_lost_behind_the_last_event_of_their_packet(
    system: RosSystem, analyse: Analyse
) -> None:
    """On the CPU of the packet only."""
    system.add_packet(0, 100, last_event=90)
    system.add_packet(100, 200, last_event=120, discarded=7)
    system.add_packet(200, 300)
    system.add_packet(0, 300, cpu=1)
    model = analyse(system)
    assert model.rows(GAPS) == [("loss", 0, 120, 200, 7)]
    assert model.rows("SELECT discarded_event_count, event_count FROM trace") == [(7, 4)]
    assert model.rows("SELECT severity, count FROM finding WHERE name = 'discarded_events'") == [
        ("error", 7)
    ]


def test_events_are_lost_before_a_packet_that_waited_for_room(
    system: RosSystem, analyse: Analyse
) -> None:
    """The one before was full to the last byte. Without a loss, nothing happened in between."""
    system.add_packet(0, 100)
    system.add_packet(180, 300, last_event=290, discarded=7)
    system.add_packet(350, 400, last_event=390)
    system.add_packet(400, 500, last_event=480, discarded=2)
    start = system.add("ros2:callback_start", Thread(100), ts=90, callback=0xC1)
    system.add("ros2:callback_end", Thread(100), ts=200, callback=0xC1)
    model = analyse(system)
    assert model.rows(GAPS) == [
        ("loss", 0, 100, 180, None),
        ("loss", 0, 290, 300, 7),
        ("loss", 0, 480, 500, 2),
    ]
    assert model.rows("SELECT start_ns, end_ns FROM callback_instance") == [(start, None)]
    assert model.rows("SELECT severity, count FROM finding WHERE name = 'discarded_events'") == [
        ("error", 9)
    ]


def test_packets_are_lost_before_one_that_counts_a_loss(
    system: RosSystem, analyse: Analyse
) -> None:
    system.add_packet(0, 100)
    system.add_packet(180, 300, last_event=290, discarded=7, lost_packets=2)
    assert analyse(system).rows(GAPS) == [
        ("packets", 0, 100, 180, None),
        ("loss", 0, 290, 300, 7),
    ]


def test_a_packet_may_hold_nothing_but_a_loss(system: RosSystem, analyse: Analyse) -> None:
    system.add_packet(0, 100)
    system.add_packet(100, 200, count=0, discarded=7)
    assert analyse(system).rows(GAPS) == [("loss", 0, 100, 200, 7)]


def test_nothing_is_lost_within_a_packet_that_takes_no_time(
    system: RosSystem, analyse: Analyse
) -> None:
    """A run of a callback that starts where it lies is whole."""
    system.add_packet(0, 100)
    system.add_packet(180, 180, count=0, discarded=7)
    system.add_packet(180, 300)
    start = system.add("ros2:callback_start", Thread(100), ts=180, callback=0xC1)
    end = system.add("ros2:callback_end", Thread(100), ts=200, callback=0xC1)
    model = analyse(system)
    assert model.rows(GAPS) == [("loss", 0, 100, 180, 7)]
    assert model.rows("SELECT start_ns, end_ns FROM callback_instance") == [(start, end)]


def test_a_packet_that_takes_no_time_may_have_no_other_place_for_a_loss(
    system: RosSystem, analyse: Analyse
) -> None:
    system.add_packet(0, 100)
    system.add_packet(100, 100, count=0, discarded=7)
    assert analyse(system).rows(GAPS) == [("loss", 0, 100, 100, 7)]


@pytest.mark.thorough
def test_lost_packets_lie_between_those_around_them(system: RosSystem, analyse: Analyse) -> None:
    system.add_packet(0, 100)
    system.add_packet(400, 500, lost_packets=3)
    system.add_packet(0, 500, cpu=1)
    model = analyse(system)
    assert model.rows(GAPS) == [("packets", 0, 100, 400, None)]
    assert model.rows("SELECT severity FROM finding WHERE name = 'lost_packets'") == [("error",)]


def test_a_pause_is_a_silence_of_all_streams(system: RosSystem, analyse: Analyse) -> None:
    for cpu in (0, 1):
        system.add_packet(0, 10 * MS + cpu, cpu=cpu)
        system.add_packet(50 * MS - cpu, 60 * MS, cpu=cpu)
    model = analyse(system)
    assert model.rows(GAPS) == [("pause", None, 10 * MS + 1, 50 * MS - 1, None)]
    assert model.rows("SELECT severity, count FROM finding WHERE name = 'tracing_paused'") == [
        ("warning", 1)
    ]


def test_a_silence_of_one_stream_is_none(system: RosSystem, analyse: Analyse) -> None:
    """Nor are two that do not overlap."""
    system.add_packet(0, 10 * MS)
    system.add_packet(30 * MS, 60 * MS)
    system.add_packet(0, 35 * MS, cpu=1)
    system.add_packet(50 * MS, 60 * MS, cpu=1)
    assert analyse(system).rows(GAPS) == []


def test_traces_pause_apart(system: RosSystem, analyse: Analyse) -> None:
    system.add_source(1, "beta", "boot-b")
    system.add_packet(0, 60 * MS, trace=0)
    system.add_packet(0, 10 * MS, trace=1)
    system.add_packet(50 * MS, 60 * MS, trace=1)
    assert analyse(system).rows("SELECT trace_id, kind, start_ns, end_ns FROM gap") == [
        (2, "pause", 10 * MS, 50 * MS)
    ]


def test_flushing_at_the_end_is_no_pause(system: RosSystem, analyse: Analyse) -> None:
    """Stopping leaves an empty packet in every stream, long after the last event.

    Another system may go on.
    """
    alone(system, 1)
    system.add_packet(0, 95 * MS, trace=1)
    system.add_packet(95 * MS, 99 * MS, trace=1)
    for cpu in (0, 1):
        system.add_packet(0, 10 * MS, cpu=cpu)
        system.add_packet(90 * MS, 90 * MS, count=0, cpu=cpu)
    assert analyse(system).rows(GAPS) == []


def test_an_idle_stream_does_not_hide_a_pause(system: RosSystem, analyse: Analyse) -> None:
    """Empty packets of an idle CPU, flushed while tracing was stopped and when it went on."""
    system.add_packet(0, 10 * MS, cpu=0, count=0)
    system.add_packet(50 * MS, 50 * MS, cpu=0, count=0)
    system.add_packet(50 * MS, 60 * MS, cpu=0, count=0)
    system.add_packet(0, 10 * MS, cpu=1)
    system.add_packet(50 * MS, 60 * MS, cpu=1)
    assert analyse(system).rows(GAPS) == [("pause", None, 10 * MS, 50 * MS, None)]


def test_nobody_stops_and_starts_within_a_millisecond(system: RosSystem, analyse: Analyse) -> None:
    lengths = (MS - 1, MS)
    for trace, length in enumerate(lengths):
        alone(system, trace)
        for cpu in (0, 1):
            system.add_packet(0, 10 * MS, cpu=cpu, trace=trace)
            system.add_packet(10 * MS + length, 60 * MS, cpu=cpu, trace=trace)
    model = analyse(system)
    assert [bool(gaps_of(model, trace)) for trace in (0, 1)] == [False, True]


def events_at(system: RosSystem, *moments: int, trace: int = 0) -> None:
    for moment in moments:
        system.add(
            "ros2:rclcpp_executor_wait_for_work", Thread(100, trace=trace), ts=moment, timeout=-1
        )


def test_a_silence_as_is_usual_there_is_no_pause(system: RosSystem, analyse: Analyse) -> None:
    """Something else ended the packets, and the next ones begin with their first events."""
    # How long before it another silence ended, how long that was, and whether it is a pause.
    cases = (
        # As long as the silence between packets, and longer; a little less.
        (500 * MS, 20 * MS, False),
        (500 * MS, 25 * MS, False),
        (500 * MS, 20 * MS - 1, True),
        # It ends less than a second before, or has ended by then.
        (1_000 * MS - 1, 20 * MS, False),
        (1_000 * MS, 20 * MS, True),
    )
    end = 2_000 * MS
    for trace, (distance, length, _) in enumerate(cases):
        alone(system, trace)
        for cpu in (0, 1):
            system.add_packet(0, end, cpu=cpu, trace=trace)
            system.add_packet(end + 20 * MS, 2_100 * MS, cpu=cpu, trace=trace)
        usual_end = end - distance
        events_at(system, usual_end - length, trace=trace)
        events_at(system, *range(usual_end, end, 10 * MS), end, end + 20 * MS, trace=trace)
    model = analyse(system)
    pause = [("pause", None, end, end + 20 * MS, None)]
    for trace, case in enumerate(cases):
        assert gaps_of(model, trace) == (pause if case[-1] else []), case


def test_long_silences_are_compared_with_what_is_farther_away(
    system: RosSystem, analyse: Analyse
) -> None:
    """A second of silence with the four seconds around it; here with those behind it."""
    for trace, distance in enumerate((4_000 * MS - 1, 4_000 * MS)):
        alone(system, trace)
        for cpu in (0, 1):
            system.add_packet(0, 1_000 * MS, cpu=cpu, trace=trace)
            system.add_packet(2_000 * MS, 9_000 * MS, cpu=cpu, trace=trace)
        events_at(system, *range(900 * MS, 1_001 * MS, 10 * MS), trace=trace)
        quiet = 2_000 * MS + distance
        events_at(system, *range(2_000 * MS, quiet, 10 * MS), trace=trace)
        events_at(system, quiet, quiet + 1_000 * MS, trace=trace)
    model = analyse(system)
    assert gaps_of(model, 0) == []
    assert gaps_of(model, 1) == [("pause", None, 1_000 * MS, 2_000 * MS, None)]


def silent_at(
    system: RosSystem, *flushes: int, since: int = 1, trace: int = 0, **first: int | None
) -> None:
    """A system that is silent for 300 ms again and again, and packets that were ended meanwhile.

    Each ends `since` after its last event, and the next begins with its first one. An event of the
    last packet is at its end; `first` is said of the first packets.
    """
    events_at(system, *range(0, 6_001 * MS, 300 * MS), trace=trace)
    for cpu in (0, 1):
        begin, said = 0, first
        for end in flushes:
            system.add_packet(begin, end, last_event=end - since, cpu=cpu, trace=trace, **said)
            begin, said = end // (300 * MS) * 300 * MS + 300 * MS, {}
        system.add_packet(begin, 6_000 * MS, cpu=cpu, trace=trace)


STOPPED: Gaps = [("pause", None, 2_050 * MS, 2_100 * MS, None)]


def test_who_stops_in_a_quiet_system_pauses(system: RosSystem, analyse: Analyse) -> None:
    """Nothing but stopping ends packets in the middle of a trace before they are full."""
    silent_at(system, 2_050 * MS)
    assert analyse(system).rows(GAPS) == STOPPED


def test_a_packet_that_is_full_was_not_ended(system: RosSystem, analyse: Analyse) -> None:
    silent_at(system, 2_050 * MS, since=0)
    assert analyse(system).rows(GAPS) == []


def test_a_timer_of_the_tracer_ends_packets_at_equal_distances(
    system: RosSystem, analyse: Analyse
) -> None:
    """Within 5 ms; two others are before, around or behind, the outer one late."""
    cases = [
        (others, late)
        for others in ((1_050, 50), (1_050, 3_050), (3_050, 4_050))
        for late in (5 * MS, 5 * MS + 1)
    ]
    for trace, ((inner, outer), late) in enumerate(cases):
        alone(system, trace)
        silent_at(system, *sorted((inner * MS, 2_050 * MS, outer * MS + late)), trace=trace)
    model = analyse(system)
    for trace, (others, late) in enumerate(cases):
        found = [row for row in gaps_of(model, trace) if row[2] == 2_050 * MS]
        assert found == (STOPPED if late > 5 * MS else []), others


def test_others_end_packets_between_those_of_a_timer(system: RosSystem, analyse: Analyse) -> None:
    """Of those next to it, four on either side are compared; here at no equal distances."""
    before, after = (1_690, 1_130, 870, 460), (2_510, 2_930, 3_380, 3_710)
    expected: dict[int, Gaps] = {3: [], 4: STOPPED}
    for trace, between in enumerate(expected):
        alone(system, trace)
        others = (50, *before[:between], 2_050, *after[:between], 4_050)
        silent_at(system, *(at * MS for at in sorted(others)), trace=trace)
    model = analyse(system)
    for trace, gaps in enumerate(expected.values()):
        assert [row for row in gaps_of(model, trace) if row[2] == 2_050 * MS] == gaps


def test_streams_are_ended_one_after_the_other(system: RosSystem, analyse: Analyse) -> None:
    """Within a millisecond: equal distances of these say nothing."""
    silent_at(system, 2_050 * MS)
    system.add_packet(0, 2_050 * MS - 200, last_event=5, cpu=2)
    system.add_packet(2_100 * MS, 6_000 * MS, cpu=2)
    system.add_packet(0, 2_050 * MS - 400, last_event=5, cpu=3)
    system.add_packet(2_100 * MS, 6_000 * MS, cpu=3)
    assert analyse(system).rows(GAPS) == STOPPED


def test_earlier_snapshots_ended_packets_of_a_snapshot(system: RosSystem, analyse: Analyse) -> None:
    expected: dict[str, Gaps] = {
        "/t/snapshot-1-20260101-120000-3/ust/uid/0/64-bit": [],
        "snapshot-2-1": [],
        "/t/my-snapshot-1/ust": STOPPED,
        "/t/snapshot/ust": STOPPED,
    }
    for trace, path in enumerate(expected):
        alone(system, trace, path)
        silent_at(system, 2_050 * MS, trace=trace)
    model = analyse(system)
    assert {path: gaps_of(model, trace) for trace, path in enumerate(expected)} == expected


def test_buffers_that_wrapped_are_a_snapshot(system: RosSystem, analyse: Analyse) -> None:
    """As packets before the first one are missing, or, without numbers, may be."""
    for trace, lost in enumerate((3, None)):
        alone(system, trace)
        silent_at(system, 2_050 * MS, trace=trace, lost_packets=lost)
    assert analyse(system).rows("SELECT * FROM gap WHERE kind = 'pause'") == []


def test_a_rotation_ends_packets_too(system: RosSystem, analyse: Analyse) -> None:
    """The silence lies between packets of two traces, and then behind what opens the chunk."""
    for chunk in (0, 1):
        system.add_source(chunk, "alpha", "boot", "recording")
    events_at(system, *range(0, 2_100 * MS, 300 * MS))
    for at in range(2_100 * MS, 6_001 * MS, 300 * MS):
        system.add("ros2:rclcpp_executor_wait_for_work", Thread(100, trace=1), ts=at, timeout=-1)
    for cpu in (0, 1):
        system.add_packet(0, 2_000 * MS, last_event=1_800 * MS, cpu=cpu)
        system.add_packet(2_050 * MS, 2_050 * MS, count=0, cpu=cpu, trace=1)
        system.add_packet(2_100 * MS, 6_000 * MS, cpu=cpu, trace=1)
    assert analyse(system).rows(GAPS) == []


@pytest.mark.thorough
def test_what_opens_a_chunk_shows_that_nothing_was_stopped(
    system: RosSystem, analyse: Analyse
) -> None:
    """Silent behind it as never else: the empty packets of a rotation, not those of stopping."""
    opened, later, none = 2_000 * MS, 2_035 * MS, ()
    # Packets of the later chunk on two CPUs (begin, end, events), and the pause that they show.
    empty = (opened, opened, 0)
    cases: tuple[tuple[list[tuple[int, int, int]], list[tuple[int, int, int]], object], ...] = (
        ([empty], [empty], none),
        # An event came between the end of the chunk before and what opened this one.
        ([empty], [(opened, opened + MS - 1, 2)], none),
        ([empty], [(opened, opened + MS, 2)], (opened + MS, later)),
        # Stopping leaves empty packets too, which do not come first.
        ([empty, (opened + 9 * MS,) * 2 + (0,)], [empty], (opened + 9 * MS, later)),
        # No rotation leaves these: an event is in it; it took its time.
        ([(opened, opened, 1)], [(opened, opened, 1)], (opened, later)),
        ([(opened - 5, opened, 0)], [(opened - 5, opened, 0)], (opened, later)),
    )
    for case, (*cpus, _) in enumerate(cases):
        for trace in (2 * case, 2 * case + 1):
            system.add_source(trace, f"host {case}", f"boot {case}", f"recording {case}")
        events_at(system, *range(0, opened, 10 * MS), trace=2 * case)
        events_at(system, *range(later, 4_001 * MS, 10 * MS), trace=2 * case + 1)
        for cpu, packets in enumerate(cpus):
            system.add_packet(0, opened - 10, last_event=opened - 20, cpu=cpu, trace=2 * case)
            for begin, end, count in packets:
                system.add_packet(begin, end, count=count, cpu=cpu, trace=2 * case + 1)
            system.add_packet(later, 4_000 * MS, cpu=cpu, trace=2 * case + 1)
    model = analyse(system)
    for case, (*_, pause) in enumerate(cases):
        found = [(start, end) for _, _, start, end, _ in gaps_of(model, 2 * case + 1)]
        assert found == ([pause] if pause else []), case


def test_each_chunk_is_opened_so(system: RosSystem, analyse: Analyse) -> None:
    """Silences behind the second and the third one, far apart; the latest counts."""
    opened = 2_000 * MS, 4_000 * MS
    for trace in range(3):
        system.add_source(trace, "host", "boot", "recording")
    bounds = 0, *(at + 35 * MS for at in opened), 5_000 * MS
    for trace in range(3):
        end = opened[trace] if trace < 2 else bounds[3]
        events_at(system, *range(bounds[trace], end, 10 * MS), trace=trace)
        for cpu in (0, 1):
            if trace:
                system.add_packet(*(opened[trace - 1],) * 2, count=0, cpu=cpu, trace=trace)
            system.add_packet(bounds[trace], end - 10, last_event=end - 20, cpu=cpu, trace=trace)
    model = analyse(system)
    assert [gaps_of(model, trace) for trace in range(3)] == [[], [], []]


def test_a_recording_is_not_opened_by_an_empty_packet(system: RosSystem, analyse: Analyse) -> None:
    """Another chunk must be before it. Here it was stopped before anything was recorded."""
    for cpu in (0, 1):
        system.add_packet(MS, MS, count=0, cpu=cpu)
        system.add_packet(40 * MS, 60 * MS, cpu=cpu)
    assert analyse(system).rows(GAPS) == [("pause", None, MS, 40 * MS, None)]


def test_a_pause_is_no_usual_silence(system: RosSystem, analyse: Analyse) -> None:
    """Stopped twice for as long."""
    for cpu in (0, 1):
        for begin in (0, 100 * MS, 200 * MS):
            system.add_packet(begin, begin + 50 * MS, cpu=cpu)
    events_at(system, *(begin + at for begin in (0, 100 * MS, 200 * MS) for at in (0, 50 * MS)))
    events_at(system, 25 * MS, 125 * MS, 225 * MS)
    assert analyse(system).rows(GAPS) == [
        ("pause", None, 50 * MS, 100 * MS, None),
        ("pause", None, 150 * MS, 200 * MS, None),
    ]


def chunks(
    system: RosSystem, *, numbered: bool = True, lost: tuple[int, int] = (0, 0), opened: int
) -> None:
    """Two of one recording: until 200 ms, and on each of two CPUs from its first event on.

    The second begins with an empty packet of each CPU.
    """
    for chunk in (0, 1):
        system.add_source(chunk, "alpha", "boot", "recording")
    for cpu in (0, 1):
        system.add_packet(0, 200 * MS + cpu, cpu=cpu, trace=0, numbered=numbered)
        system.add_packet(
            opened + cpu,
            opened + cpu,
            count=0,
            cpu=cpu,
            trace=1,
            numbered=numbered,
            lost_packets=lost[cpu],
        )
        system.add_packet(opened + MS // 2 + cpu, 700 * MS, cpu=cpu, trace=1, numbered=numbered)


def test_chunks_of_a_recording_follow_each_other(system: RosSystem, analyse: Analyse) -> None:
    """The first packet of a CPU in the second is empty, the next begins with its first event."""
    chunks(system, opened=200 * MS + 12_000)
    assert analyse(system).rows(GAPS) == []


def test_stopped_at_a_rotation(system: RosSystem, analyse: Analyse) -> None:
    """The numbers go on: nothing but the time is missing."""
    chunks(system, opened=500 * MS)
    assert analyse(system).rows(GAPS) == [("pause", None, 200 * MS + 1, 500 * MS, None)]


def test_stopped_while_packets_of_one_stream_are_lost(system: RosSystem, analyse: Analyse) -> None:
    chunks(system, opened=500 * MS, lost=(0, 2))
    assert analyse(system).rows(GAPS) == [
        ("packets", 1, 200 * MS + 1, 500 * MS + 1, None),
        ("pause", None, 200 * MS + 1, 500 * MS, None),
    ]


def test_a_chunk_is_missing(system: RosSystem, analyse: Analyse) -> None:
    """As its packets are. A run does not go on behind them, nor one on both sides of another."""
    chunks(system, lost=(3, 3), opened=500 * MS)
    before, after = Thread(100), Thread(100, trace=1)
    start = system.add("ros2:callback_start", before, ts=150 * MS, callback=0xC1)
    end = system.add("ros2:callback_end", after, ts=600 * MS, callback=0xC1)
    model = analyse(system)
    assert model.rows(GAPS) == [
        ("packets", 0, 200 * MS, 500 * MS, None),
        ("packets", 1, 200 * MS + 1, 500 * MS + 1, None),
    ]
    assert model.rows("SELECT start_ns, end_ns FROM callback_instance") == [(start, None)]
    assert model.column("SELECT resumed_ns FROM thread_break") == [end]


def test_a_silence_between_chunks_without_numbers(system: RosSystem, analyse: Analyse) -> None:
    chunks(system, numbered=False, opened=500 * MS)
    assert analyse(system).rows(GAPS) == [("pause", None, 200 * MS + 1, 500 * MS, None)]


@pytest.mark.thorough
def test_a_gap_of_a_chunk_holds_for_the_recording(system: RosSystem, analyse: Analyse) -> None:
    """The thread is seen again in the next one only."""
    for chunk in (0, 1):
        system.add_source(chunk, "alpha", "boot", "recording")
    system.add_packet(0, 200, last_event=180, discarded=5, trace=0)
    system.add_packet(200, 400, trace=1)
    start = system.add("ros2:callback_start", Thread(100), ts=150, callback=0xC1)
    system.add("ros2:callback_end", Thread(100, trace=1), ts=300, callback=0xC1)
    assert analyse(system).rows(
        "SELECT start_ns, end_ns, is_loss_affected FROM callback_instance"
    ) == [(start, None, True)]


def test_packets_before_the_first_of_a_stream(system: RosSystem, analyse: Analyse) -> None:
    """Others were recorded by then; whatever was before all of them is before the recording."""
    system.add_packet(100, 600, cpu=0, lost_packets=7)
    system.add_packet(350, 600, cpu=1, lost_packets=2)
    assert analyse(system).rows(GAPS) == [("packets", 1, 100, 350, None)]


def test_a_stream_that_ends_before_events_of_others(system: RosSystem, analyse: Analyse) -> None:
    """Whatever came after them is what stopping left, a little later on each CPU."""
    system.add_packet(0, 300, cpu=0)
    system.add_packet(0, 603, cpu=1, last_event=550)
    system.add_packet(0, 600, cpu=2, last_event=10)
    assert analyse(system).rows(GAPS) == [("packets", 0, 300, 603, None)]


def test_nothing_is_paired_across_a_pause(system: RosSystem, analyse: Analyse) -> None:
    """Threads of any CPU of that trace, and only of that trace."""
    system.add_source(1, "beta", "boot-b")
    here, there = Thread(100, cpu=1), Thread(100, trace=1)
    starts = [system.start(thread, 0xC1) for thread in (here, there)]
    system.wait(5 * MS)
    ends = [system.end(thread, 0xC1) for thread in (here, there)]
    for cpu in (0, 1):
        system.add_packet(1_000, starts[0], cpu=cpu)
        system.add_packet(ends[0], 6 * MS, cpu=cpu)
    system.add_packet(1_000, 6 * MS, trace=1)
    assert analyse(system).rows(
        "SELECT trace_id, start_ns, end_ns FROM callback_instance ORDER BY 1"
    ) == [(1, starts[0], None), (2, starts[1], ends[1])]


def test_events_around_a_gap_still_pair_on_their_side(system: RosSystem, analyse: Analyse) -> None:
    """The event at the begin of the gap is the last one before it."""
    thread = Thread(100)
    before = (system.start(thread, 0xC1), system.end(thread, 0xC1))
    system.lose()
    after = (system.start(thread, 0xC1), system.end(thread, 0xC1))
    assert analyse(system).rows("SELECT start_ns, end_ns FROM callback_instance ORDER BY 1") == [
        before,
        after,
    ]


def test_the_extent_of_a_trace(system: RosSystem, analyse: Analyse) -> None:
    system.publish(Thread(100), 0x10)
    system.add_packet(500, 2_000, last_event=1_030, count=3)
    assert analyse(system).rows("SELECT start_ns, end_ns, event_count, domain FROM trace") == [
        (500, 2_000, 3, "ust")
    ]


def test_what_meets_a_gap_is_marked(system: RosSystem, analyse: Analyse) -> None:
    """A message published and taken right before the gap, and one right after it; one later."""
    system.publisher(Thread(100), 0x10, "/a")
    system.subscription(Thread(100), 0x30, "/a", callback=0xC1)
    thread = Thread(100)
    for stamp in (1, 2, 3):
        system.publish(thread, 0x10, stamp)
        system.take(thread, 0x30, stamp)
        system.start(thread, 0xC1)
        system.end(thread, 0xC1)
        if stamp == 1:
            system.lose()
    model = analyse(system)
    assert model.column(
        "SELECT source_timestamp_ns FROM publication WHERE is_loss_affected ORDER BY 1"
    ) == [2]
    assert model.column("SELECT source_timestamp_ns FROM take WHERE is_loss_affected") == []
    assert model.column("SELECT count(*) FROM link_transport WHERE is_loss_affected") == [0]


def test_a_take_whose_callback_is_in_the_gap(system: RosSystem, analyse: Analyse) -> None:
    system.subscription(Thread(100), 0x30, "/a", callback=0xC1)
    system.take(Thread(100), 0x30, 1)
    system.lose()
    system.end(Thread(100), 0xC1)
    model = analyse(system)
    assert model.column("SELECT is_loss_affected FROM take") == [True]
    assert model.column("SELECT count(*) FROM callback_instance") == [0]


@pytest.mark.thorough
def test_a_callback_whose_take_is_in_the_gap(system: RosSystem, analyse: Analyse) -> None:
    system.subscription(Thread(100), 0x30, "/a", callback=0xC1)
    system.add("ros2:rmw_take", Thread(100), message=0xB)
    system.lose()
    system.start(Thread(100), 0xC1)
    system.end(Thread(100), 0xC1)
    model = analyse(system)
    assert model.rows("SELECT method, is_loss_affected FROM take ORDER BY taken_ns DESC")[0] == (
        "callback_only",
        True,
    )
    assert model.column("SELECT is_loss_affected FROM callback_instance") == [True]


@pytest.mark.thorough
def test_a_callback_with_the_rest_of_its_take(system: RosSystem, analyse: Analyse) -> None:
    """The layers with the stamp are in the gap, the last one is not; then a call without any.

    The take before shows that takes have events here.
    """
    thread = Thread(100)
    system.subscription(thread, 0x30, "/a", callback=0xC1)
    system.take(thread, 0x30, 1)
    system.start(thread, 0xC1)
    system.end(thread, 0xC1)
    system.add("ros2:rmw_take", thread, message=0xB)
    system.lose()
    system.add("ros2:rclcpp_take", thread, message=0xB)
    system.start(thread, 0xC1)
    system.end(thread, 0xC1)
    system.start(thread, 0xC1)
    system.end(thread, 0xC1)
    model = analyse(system)
    assert model.rows(
        "SELECT method, t.is_loss_affected, o.reason FROM take AS t JOIN stat_orphan AS o "
        "USING (take_id) WHERE method = 'callback_only' ORDER BY taken_ns"
    ) == [("callback_only", True, "receiver_gap"), ("callback_only", False, "no_stamp")]


@pytest.mark.parametrize("cpu", [0, 1])
def test_a_thread_that_is_first_seen_behind_a_gap(
    system: RosSystem, analyse: Analyse, cpu: int
) -> None:
    """The layer with the stamp is lost, if its CPU lost anything; a later take has all."""
    thread = Thread(100, cpu=cpu)
    system.add_packet(0, 100, lost_packets=0)
    system.add_packet(0, 5_000, cpu=1)
    system.add_packet(1_010, 5_000, lost_packets=2)
    system.add("ros2:rcl_take", thread, ts=1_010, message=0xB)
    system.add("ros2:rclcpp_take", thread, message=0xB)
    system.take(thread, 0x30, 1)
    model = analyse(system)
    is_lost = cpu == 0
    assert model.rows(
        "SELECT t.is_loss_affected, o.reason FROM take AS t JOIN stat_orphan AS o USING (take_id) "
        "ORDER BY taken_ns"
    ) == [(is_lost, "receiver_gap" if is_lost else "no_stamp"), (False, "publisher_not_traced")]


def test_a_thread_that_began_behind_a_gap(system: RosSystem, analyse: Analyse) -> None:
    """Its process did: nothing of it is lost."""
    system.add_packet(0, 100, lost_packets=0)
    system.add_packet(600, 5_000, lost_packets=2)
    system.add("ros2:callback_end", Thread(100), ts=50, callback=0xC1)
    system.add("ros2:rcl_init", Thread(200), ts=1_000, context_handle=0x1, version="4.1.1")
    system.add("ros2:rcl_take", Thread(200, 201), ts=1_010, message=0xB)
    system.add("ros2:rclcpp_take", Thread(200, 201), message=0xB)
    assert analyse(system).column("SELECT is_loss_affected FROM take") == [False]


@pytest.mark.thorough
def test_links_of_a_run_that_meets_a_gap_are_marked(system: RosSystem, analyse: Analyse) -> None:
    thread = Thread(100)
    system.publisher(thread, 0x10, "/a")
    system.timer(thread, 0x20, 0xC0)
    for stamp in (1, 2, 3):
        system.start(thread, 0xC0)
        system.publish(thread, 0x10, stamp)
        if stamp == 2:
            system.wait(10)
            system.add("ros2:rcl_publish", thread, publisher_handle=0x77, message=0x7)
            system.lose()
        system.end(thread, 0xC0)
    model = analyse(system)
    assert model.rows(
        "SELECT b.source_timestamp_ns, l.is_loss_affected, i.end_ns IS NULL FROM link_causal AS l "
        "JOIN publication AS b USING (publication_id) "
        "JOIN callback_instance AS i USING (callback_instance_id) "
        "WHERE b.source_timestamp_ns IS NOT NULL ORDER BY 1"
    ) == [(1, False, False), (2, True, True), (3, False, False)]


def test_a_gap_at_the_end_marks_what_never_ended(system: RosSystem, analyse: Analyse) -> None:
    """A run that ended before it is whole."""
    thread, other = Thread(100), Thread(200)
    system.start(thread, 0xC1)
    system.end(thread, 0xC1)
    system.start(thread, 0xC2)
    system.lose()
    system.start(other, 0xC3)
    system.end(other, 0xC3)
    model = analyse(system)
    assert model.column("SELECT is_loss_affected FROM callback_instance ORDER BY start_ns") == [
        False,
        True,
        False,
    ]


@pytest.mark.thorough
def test_a_guess_over_a_gap_is_marked(system: RosSystem, analyse: Analyse) -> None:
    """Two publications with one stamp: a third may be in the gap between them and the take."""
    thread = Thread(100)
    system.publisher(thread, 0x10, "/a")
    system.subscription(thread, 0x30, "/a")
    for stamp in (1, 2):
        system.publish(thread, 0x10, stamp)
        system.publish(thread, 0x10, stamp)
        if stamp == 2:
            system.lose()
            system.wait(10)
        system.take(thread, 0x30, stamp)
        system.take(thread, 0x30, stamp)
    assert analyse(system).rows(
        "SELECT b.source_timestamp_ns, l.candidate_count, l.is_loss_affected "
        "FROM link_transport AS l JOIN publication AS b USING (publication_id) ORDER BY ALL"
    ) == [(1, 2, False), (1, 2, False), (2, 2, True), (2, 2, True)]


def test_a_lost_end_costs_one_run(system: RosSystem, analyse: Analyse) -> None:
    """Where no gap is declared: the others of the thread keep their ends."""
    thread = Thread(100)
    times = []
    for number in range(4):
        start = system.start(thread, 0xC1)
        end = system.end(thread, 0xC1) if number != 1 else None
        times.append((start, end))
    assert (
        analyse(system).rows("SELECT start_ns, end_ns FROM callback_instance ORDER BY start_ns")
        == times
    )


@pytest.mark.parametrize("lost", ["inner", "outer"])
def test_a_lost_end_of_nested_runs_costs_one(
    system: RosSystem, analyse: Analyse, lost: str
) -> None:
    """The outer callback spins and the inner one runs in it, three times.

    What never ends lasts until the next callback begins: nothing is nested in it.
    """
    thread = Thread(100)
    expected = []
    for number in range(3):
        missing = lost if number == 1 else None
        outer = system.start(thread, 0xC1)
        inner = system.start(thread, 0xC2)
        inner_end = system.end(thread, 0xC2) if missing != "inner" else None
        outer_end = system.end(thread, 0xC1) if missing != "outer" else None
        depth = 1 if missing == "outer" else 2
        expected += [(outer, outer_end, 1), (inner, inner_end, depth)]
    assert (
        analyse(system).rows(
            "SELECT start_ns, end_ns, depth FROM callback_instance ORDER BY start_ns"
        )
        == expected
    )


def test_a_lost_end_of_a_recursion_costs_one(system: RosSystem, analyse: Analyse) -> None:
    """Which of the two was lost, nobody can tell."""
    thread = Thread(100)
    system.start(thread, 0xC1)
    system.start(thread, 0xC1)
    system.end(thread, 0xC1)
    for _ in range(2):
        system.start(thread, 0xC1)
        system.end(thread, 0xC1)
    assert analyse(system).value("SELECT count(*) - count(end_ns) FROM callback_instance") == 1


def test_sums_of_what_packets_say_that_they_lost_fit(system: RosSystem, analyse: Analyse) -> None:
    for begin in (0, 100, 200):
        system.add_packet(begin, begin + 100, discarded=(1 << 63) - 1)
    model = analyse(system)
    assert model.rows("SELECT discarded_event_count FROM trace") == [(1 << 53,)]
    assert model.rows("SELECT count FROM finding WHERE name = 'discarded_events'") == [(1 << 53,)]
