"""Messages between clocks that are off by known amounts, in a database."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from random import Random

import duckdb
import pyarrow

EPOCH_NS = 1_741_944_413_589_793_238

Delay = Callable[[Random], float]


@dataclass(frozen=True)
class Clock:
    """A clock: what it is ahead at the begin, and by how much it runs too fast [1e-9]."""

    offset_ns: int = 0
    drift_ppb: int = 0

    def shows(self, time: int) -> int:
        """What it shows at a true time since the begin [ns]."""
        return EPOCH_NS + self.offset_ns + time + time * self.drift_ppb // 1_000_000_000

    def correction(self, at_ns: int, reference: Clock) -> tuple[Fraction, Fraction]:
        """Return offset [ns] and drift [1e-9] towards `reference` when it shows `at_ns`."""
        own, other = (1 + Fraction(clock.drift_ppb, 10**9) for clock in (self, reference))
        true = (at_ns - EPOCH_NS - self.offset_ns) / own
        return EPOCH_NS + reference.offset_ns + true * other - at_ns, (other / own - 1) * 10**9


@dataclass(frozen=True)
class Way:
    """Messages or packets between clocks: numbers of the clocks, times of sending, delays [ns]."""

    sender: int
    receiver: int
    times: Sequence[int]
    delay: Delay
    is_packet: bool = False


def fill_clocks(
    connection: duckdb.DuckDBPyConnection, clocks: Sequence[Clock], ways: Sequence[Way], seed: int
) -> None:
    """Insert a run: clock, host, process and trace number i + 1 for clock i, and the messages."""
    random = Random(seed)
    connection.execute(
        "INSERT INTO store.run (run_id, name, created_at, msgflow_version, derivation_hash) "
        "VALUES (1, 'case', '1970-01-01', '', '')"
    )
    for number, clock in enumerate(clocks, start=1):
        begin = clock.shows(0)
        for statement in (
            "INSERT INTO store.clock (clock_id, run_id, uuid, offset_ns, drift_ppb, reference_ns, "
            f"method) VALUES ({number}, 1, 'uuid-{number}', 0, 0, {begin}, 'none')",
            "INSERT INTO store.host (host_id, run_id, clock_id, hostname) "
            f"VALUES ({number}, 1, {number}, 'host-{number}')",
            "INSERT INTO store.process (process_id, run_id, host_id, pid, life) "
            f"VALUES ({number}, 1, {number}, 7, 1)",
            "INSERT INTO store.trace (trace_id, run_id, host_id, path) "
            f"VALUES ({number}, 1, {number}, 'trace-{number}')",
        ):
            connection.execute(statement)
    rows = []
    for way in ways:
        for time in way.times:
            sent = clocks[way.sender].shows(time)
            taken = clocks[way.receiver].shows(time + round(way.delay(random)))
            place = (len(rows) + 1, way.sender + 1, way.receiver + 1)
            rows.append((*place, sent, taken, int(way.is_packet)))
    names = ("id", "sender", "receiver", "sent_ns", "taken_ns", "is_packet")
    passed = pyarrow.table(
        {
            name: pyarrow.array(list(column), "int64")
            for name, column in zip(
                names, zip(*rows, strict=True) if rows else [()] * 6, strict=True
            )
        }
    )
    connection.register("passed", passed)
    connection.execute("CREATE TEMP VIEW message AS FROM passed WHERE is_packet = 0")
    connection.execute(
        "INSERT INTO store.link_packet SELECT 1, sender, receiver, sent_ns, taken_ns, 'udp', '', 1,"
        " '', 1, id, NULL FROM passed WHERE is_packet = 1"
    )
    for table, columns, values in (
        (
            "publication",
            "publication_id, process_id, start_ns, end_ns",
            "id, sender, sent_ns, sent_ns",
        ),
        ("take", "take_id, process_id, taken_ns, method", "id, receiver, taken_ns, 'rmw'"),
        (
            "link_transport",
            "publication_id, take_id, method, candidate_count, is_self_loop, is_loss_affected",
            "id, id, 'exact', 1, false, false",
        ),
    ):
        _insert(connection, table, columns, values)
    connection.execute("DROP VIEW message")
    connection.unregister("passed")


def _insert(connection: duckdb.DuckDBPyConnection, table: str, columns: str, values: str) -> None:
    """Insert a row per message; what is left out and required is 1."""
    given = [name.strip() for name in columns.split(",")]
    required = connection.execute(
        "SELECT column_name FROM duckdb_columns() WHERE schema_name = 'store' AND table_name = ? "
        "AND NOT is_nullable ORDER BY column_index",
        [table],
    ).fetchall()
    missing = [name for (name,) in required if name not in given]
    connection.execute(
        f"INSERT INTO store.{table} ({', '.join([*given, *missing])}) "
        f"SELECT {', '.join([values, *('1' for _ in missing)])} FROM message"
    )
