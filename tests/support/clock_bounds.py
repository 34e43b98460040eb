"""Clock corrections of a simulated recording, compared with the truth and with the best bound.

`judge` simulates two hosts that exchange messages. Offset (up to 15 minutes) and drift (up
to 100 ppm) depend on the seed. It ingests them with `--clock-sync messages` and compares at 41
times between the first and the last moment of the recording:

- the corrected time with the true one. It may differ by the stated bound, and by 2 ns, since every
  trace rounds to nanoseconds;
- the stated bound with the bound that the messages allow. `possible_lines` computes that bound from
  all messages that the simulator knows and both traces hold. The two may differ by 4 ns, since
  offset, drift in 1e-9, and bound are whole numbers;
- the stated bound of the drift likewise, within 2e-9.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from random import Random
from typing import TYPE_CHECKING

import duckdb

from msgflow.ingest import ingest
from msgflow_sim import simulate
from msgflow_sim.scenario.traffic import traffic
from support.possible_lines import Bound, PossibleLines

if TYPE_CHECKING:
    from pathlib import Path

SECOND = 1_000_000_000
_TIMES = 41
_ROUNDING_NS = 4
_ROUNDING_PPB = 2
# Messages as the simulator knows them, where both their traces have them.
_SENT = """
SELECT b.end_ns, t.taken_ns, x.publication_host
FROM read_parquet($transport) AS x
JOIN store.process AS bp ON x.publication_pid = bp.pid
JOIN store.host AS bh ON bp.host_id = bh.host_id AND x.publication_host = bh.hostname
JOIN store.publication AS b
    ON bp.process_id = b.process_id AND x.publication_rmw_ns = b.rmw_ns
JOIN store.process AS tp ON x.take_pid = tp.pid
JOIN store.host AS th ON tp.host_id = th.host_id AND x.take_host = th.hostname
JOIN store.take AS t ON tp.process_id = t.process_id AND x.take_rmw_ns = t.taken_ns
WHERE x.publication_host <> x.take_host
"""


@dataclass(frozen=True)
class Outcome:
    """What one recording gave. Times in ns.

    Attributes:
        messages: how many messages passed between the hosts and are in both traces.
        least, greatest: bound at the best and at the worst time.
        error: greatest difference between corrected and true time.
        outside: by how much the error exceeds the bound at most; negative if it never does.
        wider: by how much the bound exceeds what the messages allow at most.
        narrower: by how much it falls short of that at most.
        is_drift_right: the true drift differs by no more than is stated, which is no more than the
            possible lines leave open.
    """

    kind: str
    seed: int
    offset_ns: int
    drift_ppm: float
    messages: int
    least: float
    greatest: float
    error: float
    outside: float
    wider: float
    narrower: float
    is_drift_right: bool

    @property
    def is_good(self) -> bool:
        """Whether truth lies within the bound, and the bound is what it has to be."""
        return (
            self.outside <= 2
            and self.wider <= _ROUNDING_NS
            and self.narrower <= _ROUNDING_NS
            and self.is_drift_right
        )


def judge(kind: str, seed: int, directory: Path) -> Outcome:
    """Simulate, ingest and compare one recording."""
    random = Random(f"{kind}/{seed}")
    offset = random.randrange(-900 * SECOND, 900 * SECOND)
    drift = round(random.uniform(-100, 100), 3)
    simulated = simulate(
        traffic(kind, duration_ns=random.randrange(2 * SECOND, 5 * SECOND)),
        directory / "trace",
        seed=seed,
        clock_offset_ns=offset,
        clock_drift_ppm=drift,
    )
    database = directory / "msgflow.duckdb"
    ingest([simulated.directory], database, clock_sync="messages")
    with duckdb.connect(str(database), read_only=True) as con:
        (clock,) = con.execute(
            "SELECT c.reference_ns, c.offset_ns, c.drift_ppb, c.drift_uncertainty_ppb "
            "FROM main.clock AS c JOIN main.host AS h ON c.clock_id = h.clock_id "
            "WHERE h.hostname = 'beta' AND c.reference_clock_id <> c.clock_id"
        ).fetchall()
        bound = Bound(
            con.execute("SELECT at_ns, uncertainty_ns FROM main.clock_uncertainty").fetchall()
        )
        messages = con.execute(_SENT, {"transport": str(simulated.truth["transport"])}).fetchall()
        begin, end = con.execute(
            "SELECT min(t.start_ns), max(t.end_ns) FROM store.trace AS t "
            "JOIN store.host AS h ON t.host_id = h.host_id WHERE h.hostname = 'beta'"
        ).fetchall()[0]
    lines = PossibleLines(
        [(taken, sent - taken) for sent, taken, host in messages if host == "alpha"],
        [(sent, taken - sent) for sent, taken, host in messages if host == "beta"],
    )
    reference, chosen_offset, chosen_drift, drift_uncertainty = clock
    start = _epoch(simulated.meta)
    own = 1 + round(drift * 1000) / 1e9
    outcomes = []
    for number in range(_TIMES):
        time = begin + (end - begin) * number // (_TIMES - 1)
        chosen = chosen_offset - lines.offset_ns + chosen_drift / 1e9 * (time - reference)
        # beta shows epoch + offset + true * own; what has to be added is true + epoch less that.
        elapsed = time - start - offset
        true = -elapsed * (own - 1) / own - offset - lines.offset_ns
        lowest, highest = lines.range_at(time)
        least = max(highest - chosen, chosen - lowest)
        outcomes.append((bound.at(time), abs(chosen - true), bound.at(time) - least))
    true_drift = (1 / own - 1) * 1e9
    possible_drift = max(
        lines.highest_drift * 1e9 - chosen_drift, chosen_drift - lines.lowest_drift * 1e9
    )
    return Outcome(
        kind,
        seed,
        offset,
        drift,
        len(messages),
        min(stated for stated, _, _ in outcomes),
        max(stated for stated, _, _ in outcomes),
        max(error for _, error, _ in outcomes),
        max(error - stated for stated, error, _ in outcomes),
        max(excess for _, _, excess in outcomes),
        max(-excess for _, _, excess in outcomes),
        abs(chosen_drift - true_drift) <= drift_uncertainty + 1
        and abs(drift_uncertainty - possible_drift) <= _ROUNDING_PPB,
    )


def _epoch(meta: Path) -> int:
    """What alpha's clock shows at time 0."""
    return int(json.loads(meta.read_text())["hosts"]["alpha"]["begin_of_tracing_ns"])
