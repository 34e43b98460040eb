"""Sets of messages that message_filters (ApproximateTime) makes, against the algorithm itself.

A process publishes on several topics, at random; the callbacks of another node get all messages,
one after the other, and publish whenever the filter has made a set.
"""

from __future__ import annotations

from random import Random

import pytest
from support.analysis import Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import few

from msgflow_sim.approximate_time import ApproximateTime

SOURCE, RELAY, NODE = Thread(100), Thread(150), Thread(200)
OUTPUT = 0x31
PERIODS = (10, 14, 20, 20, 33, 50, 90)
Messages = list[tuple[int, int]]
# Of each publication (by its time) the inputs, the times of the callbacks, and the candidates.
LINKS = (
    "SELECT b.start_ns, i.start_ns, l.candidate_count FROM link_causal AS l "
    "JOIN callback_instance AS i USING (callback_instance_id) "
    "JOIN publication AS b ON l.publication_id = b.publication_id "
    "WHERE l.kind = 'approximate_sync'"
)


def messages(random: Random, inputs: int) -> Messages:
    """Input and stamp (ns) of each message, in the order of arrival."""
    arrivals = []
    for number in range(inputs):
        period = random.choice(PERIODS) * 1_000_000
        jitter = random.choice((10_000, 1_000_000, period // 5))
        delay = random.choice((100_000, 1_000_000, 5_000_000))
        stamp = random.randrange(period)
        while stamp < 600_000_000:
            own = stamp + random.randrange(jitter)
            arrivals.append((own + delay + random.randrange(delay // 5), number, own))
            stamp += period
    return [(number, stamp) for _, number, stamp in sorted(arrivals)]


def record(
    arrived: Messages,
    *,
    silent: float = 0,
    random: Random | None = None,
    filters: ApproximateTime[int] | None = None,
) -> tuple[RosSystem, dict[int, list[int]]]:
    """The events of such a system, and of each publication the callbacks of its set."""
    inputs = 1 + max(number for number, _ in arrived)
    system = RosSystem()
    system.context(SOURCE)
    system.node(SOURCE, 0x1, "source")
    system.context(NODE)
    system.node(NODE, 0x1, "filter")
    for number in range(inputs):
        system.publisher(SOURCE, 0x21 + number, f"/in{number}")
        system.subscription(NODE, 0x11 + number, f"/in{number}", callback=0xC1 + number)
    system.publisher(NODE, OUTPUT, "/out")
    system.annotate(NODE, "approximate_sync", [0x11 + n for n in range(inputs)], [OUTPUT])
    filters = filters or ApproximateTime(inputs)
    sets: dict[int, list[int]] = {}
    outputs = iter(range(10**12, 2 * 10**12))
    for number, stamp in arrived:
        system.publish(SOURCE, 0x21 + number, stamp)
        system.take(NODE, 0x11 + number, stamp)
        start = system.start(NODE, 0xC1 + number)
        for used in filters.add(number, stamp, start):
            if random is None or random.random() >= silent:
                sets[system.publish(NODE, OUTPUT, next(outputs))] = sorted(used)
        system.end(NODE, 0xC1 + number)
    return system, sets


def found(analysis: Analysis, system: RosSystem) -> dict[int, tuple[list[int], int]]:
    """Of each publication the callbacks that it is linked to, and the candidates."""
    links: dict[int, list[int]] = {}
    counts = {}
    for publication, start, count in analysis.build(system).rows(LINKS):
        links.setdefault(publication, []).append(start)
        counts[publication] = count
    return {each: (sorted(starts), counts[each]) for each, starts in links.items()}


@pytest.mark.parametrize("inputs", few([2, 3, 4], 3))
@pytest.mark.parametrize("seed", few(range(12), 0))
def test_sets_are_those_of_the_filter(analysis: Analysis, inputs: int, seed: int) -> None:
    system, sets = record(messages(Random(100 * inputs + seed), inputs))
    links = found(analysis, system)
    assert links.keys() == sets.keys()
    assert {
        each for each, (used, count) in links.items() if count == 1 and used != sets[each]
    } == set()


def test_sets_are_seldom_in_doubt(analysis: Analysis) -> None:
    arrived = [
        (stamp + 200_000, number, stamp)
        for number, period in enumerate((20_030_000, 14_010_000, 33_070_000))
        for stamp in range(1 + 3_700_000 * number, 1_000_000_000, period)
    ]
    system, sets = record([(number, stamp) for _, number, stamp in sorted(arrived)])
    assert len(sets) > 25
    assert found(analysis, system) == {each: (used, 1) for each, used in sets.items()}
    # What came last is no cause by itself.
    assert analysis.value("SELECT count(*) FROM link_causal WHERE kind = 'direct'") == 0


@pytest.mark.parametrize("inputs", few([2, 3], 3))
@pytest.mark.parametrize("seed", few(range(12), 0))
def test_a_filter_whose_sets_are_not_all_published(
    analysis: Analysis, inputs: int, seed: int
) -> None:
    random = Random(100 * inputs + seed)
    system, sets = record(messages(random, inputs), silent=0.4, random=random)
    links = found(analysis, system)
    assert links.keys() <= sets.keys()
    wrong = {each for each, (used, count) in links.items() if count == 1 and used != sets[each]}
    assert wrong == set()


def stamped_early(random: Random, inputs: int) -> tuple[RosSystem, dict[int, list[int]]]:
    """Callbacks stamp headers when they begin, or later; some nodes pass on those of others."""
    system = RosSystem()
    for thread, name in ((SOURCE, "source"), (RELAY, "relay"), (NODE, "filter")):
        system.context(thread)
        system.node(thread, 0x1, name)
    published = []
    for number in range(inputs):
        period = random.choice(PERIODS) * 1_000_000
        jitter = random.choice((10_000, 1_000_000, period // 5))
        work = random.choice((50_000, 1_000_000, 5_000_000))
        delay = random.choice((100_000, 1_000_000, 5_000_000))
        is_relayed = random.random() < 0.5
        system.timer(SOURCE, 0x400 + number, 0x500 + number, period=period)
        system.publisher(SOURCE, 0x21 + number, f"/{'raw' if is_relayed else 'in'}{number}")
        if is_relayed:
            system.subscription(RELAY, 0x311 + number, f"/raw{number}", callback=0x3C1 + number)
            system.publisher(RELAY, 0x321 + number, f"/in{number}")
        system.subscription(NODE, 0x11 + number, f"/in{number}", callback=0xC1 + number)
        due = random.randrange(period)
        while due < 600_000_000:
            start = due + random.randrange(jitter)
            sent = start + 50_000 + random.randrange(work)
            published.append((start, number, sent, is_relayed, delay, random.randrange(work)))
            due += period
    system.publisher(NODE, OUTPUT, "/out")
    system.annotate(NODE, "approximate_sync", [0x11 + n for n in range(inputs)], [OUTPUT])
    origin = system.now + 1_000_000
    arrived = []
    for start, number, sent, is_relayed, delay, work in sorted(published):
        source, relay = Thread(100, 1000 + number), Thread(150, 1500 + number)
        header = start + random.randrange(sent - start)
        system.now = origin + start
        system.start(source, 0x500 + number)
        system.now = stamp = origin + sent
        system.publish(source, 0x21 + number, stamp)
        system.end(source, 0x500 + number)
        if is_relayed:
            system.now = stamp + delay
            system.take(relay, 0x311 + number, stamp)
            system.start(relay, 0x3C1 + number)
            system.now = stamp = stamp + delay + work
            system.publish(relay, 0x321 + number, stamp)
            system.end(relay, 0x3C1 + number)
        arrived.append((stamp + delay, number, stamp, header))
    filters: ApproximateTime[int] = ApproximateTime(inputs, queue_size=10)
    sets: dict[int, list[int]] = {}
    free = 0
    for arrival, number, stamp, header in sorted(arrived):
        free = max(free, arrival)
        system.now = free
        system.take(NODE, 0x11 + number, stamp)
        begin = system.start(NODE, 0xC1 + number)
        for used in filters.add(number, header, begin):
            sets[system.publish(NODE, OUTPUT, 10**12 + len(sets))] = sorted(used)
        system.end(NODE, 0xC1 + number)
        free = system.now
    return system, sets


@pytest.mark.parametrize("inputs", few([2, 3, 4], 3))
@pytest.mark.parametrize("seed", few(range(12), 0))
def test_headers_are_older_than_publications(analysis: Analysis, inputs: int, seed: int) -> None:
    system, sets = stamped_early(Random(100 * inputs + seed), inputs)
    links = found(analysis, system)
    wrong = {each for each, (used, count) in links.items() if count == 1 and used != sets[each]}
    assert wrong == set()


@pytest.mark.parametrize("inputs", few([2, 3], 3))
@pytest.mark.parametrize("limits", [{"queue_size": 5}, {"longest_ns": 20_000_000}])
def test_a_filter_with_limits(analysis: Analysis, inputs: int, limits: dict[str, int]) -> None:
    arrived = messages(Random(100 * inputs), inputs)
    system, sets = record(arrived, filters=ApproximateTime(inputs, **limits))
    links = found(analysis, system)
    wrong = {each for each, (used, count) in links.items() if count == 1 and used != sets[each]}
    assert wrong == set()
