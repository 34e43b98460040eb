"""Clock values to nanoseconds since the epoch, in exact integers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

GIGA = 1_000_000_000


@dataclass(frozen=True)
class Clock:
    """A clock of the metadata.

    Attributes:
        frequency: in hertz.
        offset_seconds: from the epoch to its origin, whole seconds.
        offset_cycles: the rest of that offset, in cycles; may well be more than a second.
        name: its name, or None.
        uuid: its uuid, or None.
    """

    frequency: int = GIGA
    offset_seconds: int = 0
    offset_cycles: int = 0
    name: str | None = None
    uuid: str | None = None

    def to_ns(self, value: int) -> int:
        """Return the time of a clock value in epoch nanoseconds, rounded down."""
        cycles = value + self.offset_cycles
        return cycles * GIGA // self.frequency + self.offset_seconds * GIGA

    def to_ns_array(self, values: NDArray[np.uint64]) -> NDArray[np.int64]:
        """Return the times of many values; those beyond 64 bits wrap round."""
        import numpy as np

        origin = self.offset_seconds * GIGA
        if self.frequency == GIGA:
            return (values + np.uint64((origin + self.offset_cycles) % 2**64)).view(np.int64)
        seconds, cycles = divmod(self.offset_cycles, self.frequency)
        whole, part = np.divmod(values, np.uint64(self.frequency))
        # Both parts are below one second: their sum fits, as does a billion times it for any
        # clock of up to nine gigahertz.
        part_ns = (part + np.uint64(cycles)) * np.uint64(GIGA) // np.uint64(self.frequency)
        origin_ns = np.uint64((origin + seconds * GIGA) % 2**64)
        return (whole * np.uint64(GIGA) + part_ns + origin_ns).view(np.int64)
