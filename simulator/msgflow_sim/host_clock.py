"""Clock of a host: what it shows at a time of the simulation."""

from __future__ import annotations

_BILLION = 1_000_000_000


class HostClock:
    """The clock that a host's traces follow. `time + clock` is what it shows, ns since the epoch.

    Attributes:
        epoch_ns: what it shows at time 0.
        drift_ppb: by how much it runs too fast [1e-9].
    """

    def __init__(self, epoch_ns: int, drift_ppb: int = 0) -> None:
        self.epoch_ns = epoch_ns
        self.drift_ppb = drift_ppb

    def __radd__(self, time: int) -> int:
        """Return what it shows at `time`, ns since the begin of tracing."""
        return self.elapsed(time) + self.epoch_ns

    def elapsed(self, time: int) -> int:
        """Return how much it went on from time 0 to `time`."""
        return time + time * self.drift_ppb // _BILLION
