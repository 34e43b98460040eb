"""When chunks came: hosts that vanish, and clocks that err, on a clock that is set by hand."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from msgflow.watch import arrivals as arrivals_module
from msgflow.watch.arrivals import Arrivals
from msgflow.watch.chunk import Chunk

SECOND = 1_000_000_000
STEP = 2 * SECOND
NAMES = ("alpha", "beta", "gamma")
START = 1_700_000_000


class Robots:
    """Hosts whose chunks come once per step."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1_000.0
        self.arrivals = Arrivals(STEP)
        self.number = 0
        # Not the clock of this process: servers of other tests run by it, and would wait for ever.
        clock = SimpleNamespace(monotonic=lambda: self.now, time_ns=lambda: self.ours_ns)
        monkeypatch.setattr(arrivals_module, "time", clock)
        monkeypatch.setattr(arrivals_module, "_age_s", lambda path: 0)

    @property
    def ours_ns(self) -> int:
        return START * SECOND + round(self.now * SECOND)

    def come(self, *names: str, is_live: bool = True, **ahead_s: float) -> None:
        """Let the next chunks come, of hosts whose clocks are ahead by so much."""
        for name in names or NAMES:
            end_ns = self.ours_ns + round(ahead_s.get(name, 0) * SECOND)
            chunk = Chunk(self.number, Path(name), Path(name) / "archives" / str(self.number))
            self.arrivals.add(chunk, end_ns, is_live=is_live)
        self.number += 1
        self.now += STEP / SECOND


@pytest.fixture
def robots(monkeypatch: pytest.MonkeyPatch) -> Robots:
    return Robots(monkeypatch)


def test_a_host_that_vanishes_is_told_once(robots: Robots) -> None:
    """Even if it is the only one."""
    robots.come("alpha", "beta")
    for _ in range(4):
        robots.come("alpha")
        assert robots.arrivals.vanished(robots.now) == []
    robots.come("alpha")
    robots.now += 0.1
    assert robots.arrivals.vanished(robots.now) == [Path("beta")]
    assert robots.arrivals.vanished(robots.now) == []
    robots.come("beta")
    robots.now += 20
    assert set(robots.arrivals.vanished(robots.now)) == {Path("alpha"), Path("beta")}


def test_clocks_do_not_make_a_host_vanish(robots: Robots) -> None:
    for _ in range(20):
        robots.come("alpha", "beta", alpha=-60)
        assert robots.arrivals.vanished(robots.now) == []


def test_to_read_slowly_makes_nobody_vanish(robots: Robots) -> None:
    robots.come("alpha")
    looked_s = robots.now
    robots.now += 60
    assert robots.arrivals.vanished(looked_s) == []


def test_chunks_longer_than_a_step_are_waited_for(robots: Robots) -> None:
    """A session rotates as its owner likes: here each minute."""
    name = "20260314T092600+0100-20260314T092700+0100-0"
    robots.arrivals.add(Chunk(0, Path("a"), Path("a/archives") / name), None, is_live=True)
    robots.now += 299
    assert robots.arrivals.vanished(robots.now) == []
    robots.now += 2
    assert robots.arrivals.vanished(robots.now) == [Path("a")]


def test_a_clock_that_errs_among_others(robots: Robots) -> None:
    """It is the one that is out of step with most, even where ours errs."""
    for _ in range(3):
        robots.come(alpha=-3_600, beta=-3_600.5, gamma=0)
    found = robots.arrivals.clocks_ahead_s()
    assert found[Path("gamma")] == pytest.approx(3_600, abs=1)
    assert abs(found[Path("alpha")]) < 1
    robots.arrivals.leave_out(Path("gamma"))
    assert Path("gamma") not in robots.arrivals.clocks_ahead_s()


def test_of_two_clocks_that_is_right_which_agrees_with_ours(robots: Robots) -> None:
    for _ in range(3):
        robots.come("alpha", "beta", alpha=-60, beta=-0.3)
    found = robots.arrivals.clocks_ahead_s()
    assert found == {Path("alpha"): pytest.approx(-59.7), Path("beta"): 0}


def test_chunks_that_come_late_say_nothing_of_clocks(robots: Robots) -> None:
    robots.come("alpha", "beta", is_live=False, alpha=-500)
    robots.come("alpha", "beta", alpha=-20)
    robots.come("alpha", "beta", alpha=-20)
    assert robots.arrivals.clocks_ahead_s() == {}
    robots.come("alpha", "beta", alpha=-0.5)
    assert robots.arrivals.clocks_ahead_s()[Path("alpha")] == pytest.approx(-0.5)


def test_a_session_created_anew_is_taken_in_again(robots: Robots) -> None:
    robots.come()
    robots.come()
    robots.arrivals.leave_out(Path("beta"))
    robots.now += 60
    assert Path("beta") not in robots.arrivals.vanished(robots.now)
    assert robots.arrivals.is_left_out(Chunk(2, Path("beta"), Path("x")))
    assert not robots.arrivals.is_left_out(Chunk(2, Path("alpha"), Path("x")))
    assert not robots.arrivals.is_left_out(Chunk(0, Path("beta"), Path("x")))
    assert not robots.arrivals.is_left_out(Chunk(1, Path("beta"), Path("x")))


def test_a_chunk_is_as_old_as_its_directory(tmp_path: Path) -> None:
    assert 0 <= arrivals_module._age_s(tmp_path) < 60
    assert arrivals_module._age_s(tmp_path / "gone") == 0
