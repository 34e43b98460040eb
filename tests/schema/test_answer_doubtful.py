"""Whether publications answer the messages before them: threads of rclpy with known causes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from random import Random

import pyarrow as pa
import pytest
from support.rules import derived
from support.thorough import few

TABLES = {
    "store.publisher": "run_id = 1, publisher_id, process_id = 1, node_id = 1, created_ns",
    "store.subscription": "run_id = 1, subscription_id, node_id = 1, created_ns",
    "store.timer": "run_id = 1, process_id, period_ns, created_ns",
    "store.take": "run_id = 1, take_id, subscription_id, thread_id, start_event_id, taken_ns",
    "store.publication": (
        "run_id = 1, publication_id, publisher_id, thread_id, start_event_id, start_ns, "
        "trace_id = 1"
    ),
    "derive.exposed_trace": "trace_id, recording_id",
    "derive.recording_gap": "recording_id, start_ns, covered_until_ns",
}
STAGE = """
INSERT INTO derive.exposed_trace VALUES (1, 1);
CREATE VIEW link AS
SELECT
    b.run_id, b.thread_id, t.take_id, t.subscription_id, t.taken_ns, b.publication_id,
    b.publisher_id, b.start_event_id, b.start_ns
FROM store.publication AS b
ASOF JOIN store.take AS t
    ON b.thread_id = t.thread_id AND b.start_event_id > t.start_event_id
"""
NAMES = ("take_behind_gap", "timed_publisher", "answer_doubtful")
NAMES_OF = {
    False: ("run_id", "take_id", "subscription_id", "thread_id", "start_event_id", "taken_ns"),
    True: ("run_id", "publication_id", "publisher_id", "thread_id", "start_event_id", "start_ns"),
}
FAR = 3_600_000
ANSWER, TICK, TOCK = 1, 2, 3


@dataclass
class Process:
    """What the threads of a process did; times in milliseconds.

    Attributes:
        takes: (time, subscription, thread).
        publications: (time, publisher, thread).
        timers: (period, time of initialisation, process).
        gaps: (begin, end) of what is not recorded.
        old: what was there before the recording: publishers, subscriptions.
        foreign: subscriptions of another node than that of the publishers.
    """

    takes: list[tuple[float, int | None, int]] = field(default_factory=list)
    publications: list[tuple[float, int, int]] = field(default_factory=list)
    timers: list[tuple[float, float, int]] = field(default_factory=list)
    gaps: list[tuple[float, float]] = field(default_factory=list)
    old: Sequence[str] = ()
    foreign: Sequence[int] = ()

    def doubtful(self) -> list[tuple[int, float]]:
        """Publisher and time of each doubtful publication, in order."""
        # At one moment, takes come first.
        events = sorted(
            [(*take, False) for take in self.takes]
            + [(*publication, True) for publication in self.publications],
            key=lambda event: (event[0], event[3]),
        )
        with derived(STAGE, NAMES, TABLES) as con:
            con.executemany(
                "INSERT INTO store.publisher (publisher_id, created_ns) VALUES (?, ?)",
                [(each, None if "publishers" in self.old else 0) for each in (ANSWER, TICK, TOCK)],
            )
            con.executemany(
                "INSERT INTO store.subscription (subscription_id, node_id, created_ns) "
                "VALUES (?, ?, ?)",
                [
                    (each, 1 + (each in self.foreign), None if "subscriptions" in self.old else 0)
                    for each in (1, 2, 3)
                ],
            )
            for period, start, process in self.timers:
                con.execute(
                    "INSERT INTO store.timer (process_id, period_ns, created_ns) VALUES (?, ?, ?)",
                    [process, round(period * 1e6), round(start * 1e6)],
                )
            for begin, end in self.gaps:
                con.execute(
                    "INSERT INTO derive.recording_gap VALUES (1, ?, ?)",
                    [round(begin * 1e6), round(end * 1e6)],
                )
            for table, is_publication in (("take", False), ("publication", True)):
                rows = [
                    (1, number, of, thread, number, round(at * 1e6))
                    for number, (at, of, thread, kind) in enumerate(events, start=1)
                    if kind == is_publication
                ]
                columns = [list(column) for column in zip(*rows, strict=True)]
                con.register("event", pa.table(columns, names=list("abcdef")))
                names = ", ".join(NAMES_OF[is_publication])
                con.execute(f"INSERT INTO store.{table} ({names}) FROM event")
            found = con.execute(
                "SELECT b.publisher_id, b.start_ns / 1e6 "
                "FROM derive.answer_doubtful(1, 'link') AS d "
                "JOIN store.publication AS b USING (publication_id) ORDER BY b.start_event_id"
            ).fetchall()
        assert len(found) == len(set(found))
        return [(publisher, round(at, 6)) for publisher, at in found]

    def doubtful_publishers(self) -> dict[int, float]:
        """The share of its linked publications that is doubtful, by publisher."""
        first = {thread: min(t for t, _, of in self.takes if of == thread) for _, _, thread in
                 self.takes}  # fmt: skip
        linked = [p for at, p, thread in self.publications if at >= first.get(thread, FAR)]
        found = [publisher for publisher, _ in self.doubtful()]
        return {p: found.count(p) / linked.count(p) for p in sorted(set(linked))}


@dataclass(frozen=True)
class Subscription:
    """Messages of a subscription: period, jitter, how long callbacks last, what they publish."""

    period: float
    jitter: float = 0.1
    lasts: tuple[float, float] = (0.2, 0.4)
    publisher: int | None = ANSWER
    counts: Sequence[int] = (1,)
    gap: float = 0.1


@dataclass(frozen=True)
class Timer:
    """A timer that publishes: period, moment of its initialisation, publisher."""

    period: float
    start: float = 0.0
    publisher: int = TICK
    is_traced: bool = True


def run(
    subscriptions: Iterable[Subscription],
    timers: Sequence[Timer] = (),
    *,
    threads: int = 1,
    length: float = 4_000,
    seed: int = 1,
    is_new: bool = True,
) -> Process:
    """Execute timers that are due, then messages that are there, as the executors of rclpy do."""
    chance = Random(seed)
    process = Process(old=() if is_new else ("publishers", "subscriptions"))
    process.timers = [(each.period, each.start, 1) for each in timers if each.is_traced]
    arrivals = sorted(
        (
            (
                chance.uniform(0, 5) + number * each.period + chance.uniform(0, each.jitter),
                place,
                each,
            )
            for place, each in enumerate(subscriptions, start=1)
            for number in range(int(length / each.period))
        ),
        key=lambda arrival: arrival[0],
    )
    due = [each.start + each.period for each in timers]
    free = [0.0] * threads
    while arrivals:
        now = max(min(free), min([arrivals[0][0], *due]))
        idle = [thread for thread in range(threads) if free[thread] <= now]
        thread = chance.choice(idle)
        at = now + chance.uniform(0.02, 0.06)
        ready = [number for number, moment in enumerate(due) if moment <= now]
        if ready:
            timer = timers[ready[0]]
            process.publications.append((at, timer.publisher, thread))
            while due[ready[0]] <= now:
                due[ready[0]] += timer.period
            free[thread] = at + 0.1
            continue
        _, place, subscription = arrivals.pop(0)
        process.takes.append((at, place, thread))
        lasts = chance.uniform(*subscription.lasts)
        if subscription.publisher is not None:
            for number in range(chance.choice(subscription.counts)):
                process.publications.append(
                    (at + lasts + number * subscription.gap, subscription.publisher, thread)
                )
                free[thread] = at + lasts + number * subscription.gap
        free[thread] = max(free[thread], at + lasts) + 0.05
    return process


NOISY = Subscription(16, 0.5, (1, 7))


@pytest.mark.parametrize(
    "subscriptions",
    [
        [Subscription(50)],
        [NOISY],
        [Subscription(50, 30, (1, 20))],
        # Steadily, or for as long as a message takes to come, or longer.
        [Subscription(50, 0.02, (30, 30.1))],
        [Subscription(10, 0.1, (8, 14))],
        # To some messages only, in bursts, with another publication later on.
        [Subscription(20, 0.1, (1, 2), counts=(0, 0, 1))],
        [Subscription(20, 0.1, (1, 2), counts=(0, 1))],
        [Subscription(20, 0.1, (1, 2), counts=(0, 1, 1, 1, 1))],
        [Subscription(20, 0.1, (1, 2), counts=(3,))],
        [Subscription(20, 0.1, (1, 2), counts=(0, 1, 2, 3))],
        [Subscription(50, 0.1, (1, 2), counts=(2,), gap=12)],
        # One publisher for several subscriptions.
        [Subscription(50, 0.1, (3, 4)), Subscription(170, 0.1, (20, 30))],
        [Subscription(50), Subscription(33, publisher=None)],
    ],
)
@pytest.mark.parametrize("is_new", [True, False])
def test_answers_are_certain(subscriptions: list[Subscription], is_new: bool) -> None:
    assert run(subscriptions, is_new=is_new).doubtful() == []


@pytest.mark.parametrize("period", few([5, 20, 23, 49.9, 50, 51, 100, 700], 5, 49.9, 700))
@pytest.mark.parametrize("subscription", [Subscription(50), NOISY])
@pytest.mark.parametrize("threads", few([1, 3], 3))
def test_a_timer_beside_answers(subscription: Subscription, period: float, threads: int) -> None:
    process = run([subscription], [Timer(period, 17)], threads=threads)
    assert process.doubtful_publishers() == {ANSWER: 0, TICK: 1}


def test_a_timer_of_the_period_of_noisy_messages() -> None:
    process = run([NOISY], [Timer(16, 1.5)])
    assert process.doubtful_publishers()[TICK] == 1


@pytest.mark.parametrize("period", few([5, 20, 23, 70, 100], 5, 70))
@pytest.mark.parametrize("subscription", [Subscription(50), NOISY])
def test_a_timer_that_is_older_than_the_recording(
    subscription: Subscription, period: float
) -> None:
    """Its intervals are steadier than its delays, or messages have different numbers of them."""
    process = run([subscription], [Timer(period, 17, is_traced=False)], is_new=False)
    assert process.doubtful_publishers() == {ANSWER: 0, TICK: 1}


@pytest.mark.parametrize("period", [30, 50, 60])
def test_a_timer_that_waits_for_long_callbacks(period: float) -> None:
    process = run([Subscription(50, 0.1, (40, 48))], [Timer(period, 17)])
    assert process.doubtful_publishers()[TICK] == 1


def test_two_timers_and_two_subscriptions() -> None:
    process = run(
        [Subscription(50), Subscription(31, 1, (2, 5), publisher=None)],
        [Timer(20, 3), Timer(90, 6, TOCK)],
    )
    assert process.doubtful_publishers() == {ANSWER: 0, TICK: 1, TOCK: 1}


def test_answers_and_a_timer_on_one_publisher() -> None:
    """What comes beyond the answer is doubtful."""
    process = run([Subscription(50)], [Timer(700, 17, ANSWER)])
    ticks = [(ANSWER, round(at, 6)) for at, _, _ in process.publications if (at - 17) % 700 < 1]
    assert len(ticks) == 5
    assert process.doubtful() == ticks


@pytest.mark.parametrize("period", [31.5, 33, 35, 37])
@pytest.mark.parametrize("seed", few(range(5), 0))
def test_answers_that_take_nearly_a_period_of_a_timer(period: float, seed: int) -> None:
    """Most come after a moment when it was due, but no more of them than by chance.

    The threads take other messages soon, so they do not tell that the timer was silent.
    """
    process = run(
        [Subscription(50, 9, (30, 30.5)), Subscription(7, 1, publisher=None)],
        [Timer(period, 17)],
        threads=3,
        seed=seed,
    )
    assert process.doubtful_publishers() == {ANSWER: 0, TICK: 1}


def test_answers_to_a_timer_of_the_same_process() -> None:
    """The timer is due before each take, never between the take and the publication."""
    process = run([Subscription(50)])
    first = min(at for at, _, _ in process.takes)
    process.timers = [(50, first - 50 - 0.5, 1)]
    shift = [at - first for at, _, _ in process.takes]
    assert max(each % 50 for each in shift if each % 50 < 25) < 6
    assert process.doubtful() == []


def steady(period: float, moments: Sequence[float], count: int = 20) -> Process:
    """A message every so often, and publications at equal moments after each."""
    process = Process()
    for number in range(1, count + 1):
        process.takes.append((number * period, 1, 1))
        process.publications += [(number * period + each, TICK, 1) for each in moments]
    return process


def test_a_timer_that_is_due_between_the_take_and_the_publication() -> None:
    process = steady(100, [60])
    process.timers = [(100, -95, 1)]
    assert process.doubtful_publishers() == {TICK: 1}
    # Another process, one whose initialisation comes later, other periods, none.
    for other in ((100, -95, 2), (100, 3_905, 1), (143, -95, 1), (0, -95, 1)):
        process.timers = [other]
        assert process.doubtful() == []


def test_the_first_timer_of_a_period_counts() -> None:
    """The others are those of waits that may time out."""
    process = steady(100, [60])
    process.timers = [(100, -95, 1), *((100, number * 7.3, 1) for number in range(-9, 9))]
    assert process.doubtful_publishers() == {TICK: 1}
    process.timers = [(100, -130, 1), (100, -95, 1)]
    assert process.doubtful() == []


@pytest.mark.parametrize(("others", "is_doubtful"), [(11, True), (10, False)])
def test_most_wait_for_a_callback(others: int, is_doubtful: bool) -> None:
    """The timer was due since the take, but for one message out of some.

    Of 60 ms after a take, chance puts that moment into three out of five.
    """
    process = Process(timers=[(100, 0, 1)])
    for number in range(1, 101):
        shift = 5 * (number % 2)
        last = 2 if number % (others + 1) == 0 else -10
        process.takes.append((number * 100 + shift + last, 1, 1))
        process.publications.append((number * 100 + shift + 50, TICK, 1))
    assert process.doubtful_publishers() == {TICK: float(is_doubtful)}


@pytest.mark.parametrize(("period", "is_doubtful"), [(40, True), (39.9, False)])
def test_a_timer_would_publish_again_before_the_next_take(period: float, is_doubtful: bool) -> None:
    """If that is a period away: the next one of this thread."""
    process = steady(200, [160])
    process.takes += [(number * 200 + 170, 2, 2) for number in range(1, 20)]
    process.publications += [(number * 200 + 171, TOCK, 2) for number in range(1, 20)]
    process.timers = [(period, 360 - 10.5 * period, 1)]
    assert process.doubtful_publishers() == {TICK: float(is_doubtful), TOCK: 0}


@pytest.mark.parametrize(("spread", "is_doubtful"), [(10, False), (13, True)])
def test_own_intervals_are_steadier_by_a_fifth(spread: float, is_doubtful: bool) -> None:
    """Of both, only the middle four fifths count."""
    process = Process()
    for number in range(1, 101):
        at = number * 100 + (0, 5, 0, 5, 5)[number % 5]
        process.publications.append((at + (30 if number % 20 == 7 else 0), TICK, 1))
        delay = 40 if number % 2 else 40 - spread
        process.takes.append((at - delay - (20 if number % 20 == 9 else 0), 1, 1))
    assert process.doubtful_publishers() == {TICK: float(is_doubtful)}


def ticks(count: int, gaps: Iterable[int]) -> Process:
    """Publications every 100 ms, but in these gaps of one each, after takes at any moment."""
    process = Process(gaps=[(number * 100 - 20, number * 100 + 20) for number in gaps])
    hidden = set(gaps)
    for number in range(1, count + 1):
        if number not in hidden:
            process.takes.append((number * 100 - 20 - 7 * (number % 5), 1, 1))
            process.publications.append((number * 100, TICK, 1))
    return process


def test_intervals_with_a_gap_do_not_count() -> None:
    """A timer goes on in it, and what it publishes is lost."""
    process = ticks(60, range(4, 60, 4))
    assert process.doubtful_publishers() == {TICK: 1}
    process.gaps = []
    assert process.doubtful() == []


@pytest.mark.parametrize(("rest", "is_doubtful"), [(4, False), (5, True)])
def test_too_few_intervals_without_a_gap(rest: int, is_doubtful: bool) -> None:
    """Where a gap lies in nearly all, all count."""
    process = ticks(21 + rest, range(2, 21, 2))
    assert process.doubtful_publishers() == {TICK: float(is_doubtful)}


def answering(intervals: Sequence[float], delays: Sequence[float]) -> Process:
    """Publications at these intervals, each so long after a take."""
    process = Process()
    at = 0.0
    for interval, delay in zip(intervals, delays, strict=True):
        at += interval
        process.takes.append((at - delay, 1, 1))
        process.publications.append((at, TICK, 1))
    return process


@pytest.mark.parametrize(("short", "counts"), [(7, False), (15, True)])
def test_a_few_short_delays_and_intervals_say_nothing(short: int, counts: bool) -> None:
    """Those of less than a tenth of the messages."""
    rare = [number < short for number in range(101)]
    delays = answering([90, 100] * 50 + [90], [20 if each else 40 for each in rare])
    assert delays.doubtful_publishers() == {TICK: float(counts)}
    intervals = answering([60 if each else 100 for each in rare], [20, 40] * 50 + [20])
    assert intervals.doubtful_publishers() == {TICK: float(not counts)}


@pytest.mark.parametrize("moments", [[2, 52], [2, 27, 52, 77], [2, 30, 70]])
def test_a_period_that_the_messages_do_not_have(moments: Sequence[float]) -> None:
    """Or nearly one: it may answer each message several times, or none."""
    assert steady(100, moments).doubtful_publishers() == {TICK: 1}
    assert steady(100, [each / 10 for each in moments]).doubtful() == []


@pytest.mark.parametrize("period", [45, 50, 104, 150])
def test_a_loop_that_looks_at_the_time_after_each_message(period: float) -> None:
    """So it publishes right after some of them, and the delay says nothing."""
    process, due = Process(), 0.0
    for number in range(1, 200):
        process.takes.append((number * 20, 1, 1))
        if number * 20 >= due:
            process.publications.append((number * 20 + 0.1, TICK, 1))
            due = max(due + period, number * 20)
    assert process.doubtful_publishers() == {TICK: 1}


@pytest.mark.parametrize("each", [2, 5])
def test_one_of_so_many_messages_is_answered(each: int) -> None:
    process = steady(20, [0.1], 40 * each)
    process.publications = process.publications[::each]
    assert process.doubtful() == []


def test_timers_of_a_busy_thread() -> None:
    """They wait for callbacks, so that the delay is steady, and when they were due is long ago."""
    busy = Subscription(4.9, 0.1, (1.35, 2.6))
    process = run(
        [busy, replace(busy, publisher=None)], [Timer(17, 1.5), Timer(31, 2, TOCK)], length=2_000
    )
    assert process.doubtful_publishers() == {ANSWER: 0, TICK: 1, TOCK: 1}


def test_answers_of_one_node_to_messages_of_another() -> None:
    process = run([Subscription(50), Subscription(33, publisher=TICK)])
    assert process.doubtful() == []
    process.foreign = [2]
    assert process.doubtful_publishers() == {ANSWER: 0, TICK: 1}


@pytest.mark.parametrize(("foreign", "is_doubtful"), [(10, False), (11, True)])
def test_what_often_follows_messages_to_another_node_answers_none(
    foreign: int, is_doubtful: bool
) -> None:
    takes = [(50.0 * number + number % 7, 2 if number <= foreign else 1, 1)
             for number in range(1, 101)]  # fmt: skip
    process = Process(takes, [(at + 1, TICK, 1) for at, _, _ in takes], foreign=[2])
    doubted = takes if is_doubtful else takes[:foreign]
    assert process.doubtful() == [(TICK, at + 1) for at, _, _ in doubted]


@pytest.mark.parametrize(("more", "is_doubtful"), [(10, False), (11, True)])
def test_another_number_per_message(more: int, is_doubtful: bool) -> None:
    """After more than a tenth of the messages; if it is less, only what comes beyond."""
    process = steady(100, [2], 100)
    beyond = [(number * 100 + 30, TICK, 1) for number in range(1, more + 1)]
    process.publications += beyond
    expected = process.publications if is_doubtful else beyond
    assert process.doubtful() == sorted((TICK, round(at, 6)) for at, _, _ in expected)


@pytest.mark.parametrize(("fewer", "is_doubtful"), [(9, False), (11, True)])
def test_a_smaller_number_per_message(fewer: int, is_doubtful: bool) -> None:
    process = steady(100, [2, 30], 100)
    for number in range(1, fewer + 1):
        process.publications.remove((number * 100 + 30, TICK, 1))
    assert process.doubtful_publishers() == {TICK: float(is_doubtful)}


def test_what_comes_beyond_the_usual_number_of_few_messages() -> None:
    """Usual is what half of the messages have, or fewer."""
    process = steady(100, [2, 30], 4)
    process.publications.remove((130, TICK, 1))
    assert process.doubtful() == []
    process.publications.remove((230, TICK, 1))
    assert process.doubtful() == [(TICK, 330), (TICK, 430)]


def test_each_publisher_has_a_usual_number() -> None:
    process = steady(100, [2], 100)
    process.publications += [(number * 100 + 3, TOCK, 1) for number in range(1, 101)]
    beyond: list[tuple[float, int, int]] = [(530, TICK, 1), (540, TOCK, 1)]
    process.publications += beyond
    assert process.doubtful() == [(publisher, at) for at, publisher, _ in beyond]


def test_the_usual_number_may_differ_by_subscription() -> None:
    process = steady(100, [2, 30], 100)
    process.takes += [(number * 100 + 50, 2, 1) for number in range(1, 101)]
    process.publications += [(number * 100 + 52, TICK, 1) for number in range(1, 101)]
    assert process.doubtful() == []


@pytest.mark.parametrize(("gap", "is_doubtful"), [(5.4, False), (7.5, True)])
def test_a_burst_is_closer_than_a_tenth_of_the_interval(gap: float, is_doubtful: bool) -> None:
    process = steady(100, [2], 100)
    process.publications += [(number * 100 + 2 + gap, TICK, 1) for number in range(1, 50)]
    assert process.doubtful_publishers() == {TICK: float(is_doubtful)}


@pytest.mark.parametrize("count", [1, 4, 5])
@pytest.mark.parametrize("old", ["publishers", "subscriptions"])
def test_too_few_to_tell(count: int, old: str) -> None:
    """They are answers if no timer may be there that is not traced."""
    process = steady(50, [3], count)
    assert process.doubtful() == []
    process.old = [old]
    assert process.doubtful_publishers() == {TICK: float(count < 5)}
    process.old = []
    process.timers = [(7_000, 0, 1)]
    assert process.doubtful_publishers() == {TICK: float(count < 5)}
    process.timers = [(7_000, 0, 2)]
    assert process.doubtful() == []


def test_of_a_subscription_that_is_not_known() -> None:
    """It is older than the recording."""
    process = steady(50, [3], 4)
    process.takes = [(at, None, thread) for at, _, thread in process.takes]
    assert process.doubtful_publishers() == {TICK: 1}


def test_few_messages_of_another_subscription() -> None:
    """A timer explains the publisher, whatever the message before."""
    process = run([Subscription(50), Subscription(1_500, publisher=None)], [Timer(20, 17)])
    assert process.doubtful_publishers() == {ANSWER: 0, TICK: 1}
