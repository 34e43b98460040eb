"""Messages from publication to take where publications carry no stamp: by time."""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random

import pytest
from support.analysis import Analyse
from support.ros_system import RosSystem
from support.staged_events import Thread
from support.thorough import few

TALKER = Thread(100)
LISTENER = Thread(200)
LINKS = (
    "SELECT b.rcl_ns, t.source_timestamp_ns, l.method FROM link_transport AS l "
    "JOIN publication AS b USING (publication_id) JOIN take AS t ON l.take_id = t.take_id "
    "ORDER BY t.take_id"
)
_EPOCH = 1_700_000_000_000_000_000


@dataclass
class Unstamped:
    """A system whose publishers never say what stamp a message got.

    Attributes:
        system: the events.
        truth: (time of rcl_publish, stamp) of each message that was published in the trace.
        listener: who takes the messages.
        lateness: of a timer, less than this.
    """

    system: RosSystem
    random: Random = field(default_factory=lambda: Random(7))
    truth: list[tuple[int, int]] = field(default_factory=list)
    listener: Thread = LISTENER
    lateness: int = 80_000

    def difference(self, _time: int) -> int:
        return 0

    def message(
        self,
        time: int,
        thread: Thread = TALKER,
        *,
        handle: int = 0x10,
        reader: int = 0x20,
        delay: int = 12_000,
        is_traced: bool = True,
        is_taken: bool = True,
    ) -> int:
        """Publish inside a timer callback and take 200 µs later; returns the stamp."""
        time += self.random.randrange(self.lateness)
        add = self.system.add
        add("ros2:callback_start", thread, ts=time, callback=0xC1, is_intra_process=0)
        if is_traced:
            add("ros2:rclcpp_publish", thread, ts=time + 5_000, message=0xA)
            add("ros2:rcl_publish", thread, ts=time + 6_000, publisher_handle=handle, message=0xA)
            add("ros2:rmw_publish", thread, ts=time + 7_000, message=0xA)
        made = time + 7_000 + delay + self.random.randrange(delay // 2)
        stamp = made + self.difference(made)
        add("ros2:callback_end", thread, ts=made + 20_000, callback=0xC1)
        if is_taken:
            self.system.add(
                "ros2:rmw_take",
                self.listener,
                ts=made + 200_000 + self.random.randrange(50_000),
                rmw_subscription_handle=reader + 0x1000,
                message=0xB,
                source_timestamp=stamp,
                taken=1,
            )
            self.system.add("ros2:rcl_take", self.listener, ts=self.system.now + 1_000, message=0xB)
        if is_traced and is_taken:
            self.truth.append((time + 6_000, stamp))
        return stamp


class Slewed(Unstamped):
    """The clock of ROS gains 20 µs per second, and jumps back by 3 ms after four seconds."""

    def difference(self, time: int) -> int:
        elapsed = time - _EPOCH
        return elapsed * 20 // 1_000_000 - (3_000_000 if elapsed > 4_000_000_000 else 0)


@pytest.fixture
def unstamped(system: RosSystem) -> Unstamped:
    """A publisher and a subscription of /a in two processes."""
    system.wait(_EPOCH - 10_000_000)
    system.publisher(TALKER, 0x10, "/a")
    system.subscription(LISTENER, 0x20, "/a")
    return Unstamped(system)


def expected(truth: list[tuple[int, int]]) -> list[tuple[int, int, str]]:
    return [(published, stamp, "nearest") for published, stamp in truth]


def test_every_message_has_its_publication(unstamped: Unstamped, analyse: Analyse) -> None:
    for n in range(40):
        unstamped.message(_EPOCH + n * 10_000_000)
    assert analyse(unstamped.system).rows(LINKS) == expected(unstamped.truth)


def test_what_is_not_in_the_trace_has_no_link(unstamped: Unstamped, analyse: Analyse) -> None:
    """Neither messages whose publication is lost, nor publications nobody took."""
    for n in range(60):
        unstamped.message(
            _EPOCH + n * 10_000_000,
            is_traced=unstamped.random.random() < 0.7,
            is_taken=unstamped.random.random() < 0.8,
        )
    assert 0 < len(unstamped.truth) < 50
    assert analyse(unstamped.system).rows(LINKS) == expected(unstamped.truth)


@pytest.mark.thorough
def test_the_messages_of_an_untraced_publisher_have_no_link(
    unstamped: Unstamped, analyse: Analyse
) -> None:
    for n in range(40):
        unstamped.message(_EPOCH + n * 10_000_000)
        unstamped.message(_EPOCH + n * 10_000_000 + 3_000_000, Thread(300), is_traced=False)
    assert analyse(unstamped.system).rows(LINKS) == expected(unstamped.truth)


@pytest.mark.thorough
def test_a_long_write_is_no_obstacle(unstamped: Unstamped, analyse: Analyse) -> None:
    """Ten megabytes are stamped milliseconds after the write began."""
    for n in range(40):
        unstamped.message(_EPOCH + n * 100_000_000, delay=8_000_000)
    assert analyse(unstamped.system).rows(LINKS) == expected(unstamped.truth)


@pytest.mark.thorough
def test_a_process_that_stamps_lost_an_event(unstamped: Unstamped, analyse: Analyse) -> None:
    """Its other publications say what their messages look like: nothing is matched by time."""
    for n in range(10):
        unstamped.message(_EPOCH + n * 10_000_000)
    unstamped.system.publish(TALKER, 0x10, 12345)
    assert analyse(unstamped.system).rows(LINKS) == []


@pytest.mark.thorough
def test_a_stamp_that_some_publication_has_is_no_message_of_another(
    unstamped: Unstamped, analyse: Analyse
) -> None:
    stamper = Thread(400)
    stamps = [unstamped.message(_EPOCH + n * 10_000_000) for n in range(10)]
    unstamped.system.publisher(stamper, 0x10, "/a")
    unstamped.system.publish(stamper, 0x10, stamps[3])
    rows = analyse(unstamped.system).rows(LINKS)
    assert [row[2] for row in rows].count("exact") == 1
    assert [row for row in rows if row[2] == "nearest"] == expected(
        [pair for pair in unstamped.truth if pair[1] != stamps[3]]
    )


@pytest.mark.thorough
def test_two_publishers_at_once_are_ambiguous(unstamped: Unstamped, analyse: Analyse) -> None:
    """Two processes write at the same moment, and one message arrives: it may be of either."""
    other = Thread(300)
    unstamped.system.publisher(other, 0x10, "/a")
    for n in range(20):
        unstamped.message(_EPOCH + n * 10_000_000)
    for n in range(20):
        unstamped.message(_EPOCH + 5_000_000 + n * 10_000_000, other)
    at = _EPOCH + 500_000_000
    for thread, shift in ((TALKER, 0), (other, 1_000)):
        unstamped.system.add("ros2:rclcpp_publish", thread, ts=at + shift, message=0xA)
        unstamped.system.add(
            "ros2:rcl_publish", thread, ts=at + shift + 1_000, publisher_handle=0x10, message=0xA
        )
        unstamped.system.add("ros2:rmw_publish", thread, ts=at + shift + 2_000, message=0xA)
        unstamped.system.add("ros2:callback_end", thread, ts=at + shift + 40_000, callback=0xC1)
    unstamped.system.add(
        "ros2:rmw_take",
        LISTENER,
        ts=at + 200_000,
        taken=1,
        message=0xB,
        rmw_subscription_handle=0x1020,
        source_timestamp=at + 17_000,
    )
    model = analyse(unstamped.system)
    assert model.rows(LINKS) == sorted(expected(unstamped.truth), key=lambda row: row[1])
    assert model.rows(
        "SELECT source_timestamp_ns, candidate_count FROM store.nearest_message "
        "WHERE publication_id IS NULL"
    ) == [(at + 17_000, 2)]
    assert model.column("SELECT DISTINCT reason FROM store.orphan_take") == ["ambiguous"]


@pytest.mark.thorough
def test_a_clock_that_drifts_and_jumps_is_followed(system: RosSystem, analyse: Analyse) -> None:
    """Links are right all the way; in the second around the jump there are none."""
    slewed = Slewed(system)
    system.wait(_EPOCH - 10_000_000)
    system.publisher(TALKER, 0x10, "/a")
    system.subscription(LISTENER, 0x20, "/a")
    for n in range(800):
        slewed.message(_EPOCH + n * 10_000_000, is_traced=slewed.random.random() < 0.9)
    model = analyse(system)
    links = {(published, stamp) for published, stamp, _ in model.rows(LINKS)}
    assert links <= set(slewed.truth)
    assert len(links) >= 0.8 * len(slewed.truth)


@pytest.mark.thorough
def test_a_gap_after_the_publication_makes_the_link_doubtful(
    unstamped: Unstamped, analyse: Analyse
) -> None:
    """What the thread did next may be lost: the usual delay alone bounds the search."""
    for n in range(20):
        unstamped.message(_EPOCH + n * 10_000_000)
    published = unstamped.truth[4][0]
    unstamped.system.add_packet(
        published - 10_000, published + 4_000, last_event=published + 1_500, discarded=3
    )
    model = analyse(unstamped.system)
    assert model.rows(LINKS) == expected(unstamped.truth)
    assert model.column(
        "SELECT b.rcl_ns FROM link_transport AS l JOIN publication AS b USING (publication_id) "
        "WHERE l.is_loss_affected"
    ) == [published]


class Jumping(Unstamped):
    """The clock of ROS jumps back by just one period after four seconds."""

    def difference(self, time: int) -> int:
        return -10_000_000 if time - _EPOCH > 4_000_000_000 else 0


class Coarse(Unstamped):
    """The clock of ROS advances every four milliseconds."""

    def difference(self, time: int) -> int:
        return -(time % 4_000_000)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "share", "reason"), [(Jumping, 0.4, "clock_set"), (Coarse, 0.0, "ambiguous")]
)
def test_a_clock_that_fits_by_chance_tells_nothing(
    system: RosSystem, analyse: Analyse, kind: type[Unstamped], share: float, reason: str
) -> None:
    """No link is wrong; what cannot be told says why."""
    unstamped = kind(system)
    system.wait(_EPOCH - 10_000_000)
    system.publisher(TALKER, 0x10, "/a")
    system.subscription(LISTENER, 0x20, "/a")
    for n in range(800):
        unstamped.message(_EPOCH + n * 10_000_000 + unstamped.random.randrange(300_000))
    model = analyse(system)
    links = {(published, stamp) for published, stamp, _ in model.rows(LINKS)}
    assert links <= set(unstamped.truth)
    assert len(links) >= share * len(unstamped.truth)
    assert reason in model.column("SELECT DISTINCT reason FROM store.orphan_take")


@dataclass
class Remote(Unstamped):
    """Only a host of another clock takes the messages: they may be those of any period.

    Attributes:
        offset: how far the clock of ROS is ahead.
        jump: how far it goes ahead after four seconds.
    """

    offset: int = 0
    jump: int = 0

    def __post_init__(self) -> None:
        self.listener = Thread(200, trace=1)
        self.system.add_source(1, "beta", "boot-b")
        self.system.wait(_EPOCH - 10_000_000)
        self.system.publisher(TALKER, 0x10, "/a")
        self.system.subscription(self.listener, 0x20, "/a")

    def difference(self, time: int) -> int:
        return self.offset + (self.jump if time - _EPOCH > 4_000_000_000 else 0)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "offset", few([300_000, -200_000, 7_000_000, -10_000_000, 40_000_000], 40_000_000)
)
@pytest.mark.parametrize("count", few([100, 800], 100))
def test_a_clock_is_told_from_others_a_period_away(
    system: RosSystem, analyse: Analyse, offset: int, count: int
) -> None:
    """A timer is late by more than what passes from a write to its stamp varies."""
    remote = Remote(system, offset=offset)
    for n in range(count):
        remote.message(_EPOCH + n * 10_000_000)
    assert analyse(system).rows(LINKS) == expected(remote.truth)


@pytest.mark.thorough
@pytest.mark.parametrize("offset", few([0, 4_000_000, 13_000_000], 4_000_000))
def test_a_timer_that_is_never_late_does_not_tell_its_periods_apart(
    system: RosSystem, analyse: Analyse, offset: int
) -> None:
    remote = Remote(system, offset=offset, lateness=1)
    for n in range(300):
        remote.message(_EPOCH + n * 10_000_000)
    links = {(published, stamp) for published, stamp, _ in analyse(system).rows(LINKS)}
    assert links == (set(remote.truth) if offset == 0 else set())


@pytest.mark.thorough
@pytest.mark.parametrize("jump", few([-10_000_000, 10_000_000], 10_000_000))
def test_a_jump_by_a_period_is_followed(system: RosSystem, analyse: Analyse, jump: int) -> None:
    remote = Remote(system, jump=jump)
    for n in range(800):
        remote.message(_EPOCH + n * 10_000_000)
    links = {(published, stamp) for published, stamp, _ in analyse(system).rows(LINKS)}
    assert links <= set(remote.truth)
    assert len(links) >= 0.75 * len(remote.truth)
