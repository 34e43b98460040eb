"""Staged events from readable rows: what a reader would have delivered, without any trace file.

    events = StagedEvents()
    events.add("ros2:rcl_publish", Thread(100), publisher_handle=0x10, message=0xA)

`write` fills the tables of `raw` and `staging` that the model is built from; analysis.py runs the
rest of an ingest on them.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import duckdb
import pyarrow as pa

from msgflow.db.store import empty
from msgflow.ingest import overlapping_traces
from msgflow.ingest.catalogue import Tracepoint, load
from msgflow.ingest.cpus import Cpus
from msgflow.ingest.load import without_thread
from msgflow.ingest.readings import READING
from msgflow.ingest.sequences import Sequences
from msgflow.trace.columns import COMMON_SCHEMA, PACKET_SCHEMA

STEP_NS = 10


@dataclass(frozen=True)
class Thread:
    """Where an event happens; the main thread of its process where no tid is given."""

    pid: int = 100
    tid: int | None = None
    name: str | None = "main"
    cpu: int = 0
    trace: int = 0
    pid_ns: int | None = None

    @property
    def vtid(self) -> int:
        return self.pid if self.tid is None else self.tid


@dataclass(frozen=True)
class Source:
    """A trace: its host, its clock, its recording unless it is alone, and its path.

    `origin_ns` is when its clock began to count; a tracer that is not of LTTng-UST is the kernel's.
    """

    hostname: str = "alpha"
    clock: str = "boot"
    recording: str | None = None
    path: str | None = None
    tracer: str = "lttng-ust 2.13.9"
    origin_ns: int = 0

    @property
    def domain(self) -> str:
        return "ust" if self.tracer.startswith("lttng-ust") else "kernel"


class StagedEvents:
    """Events, packets and traces of one ingest, in the order in which they are added.

    The total order is that of the time stamps, and of addition where they are equal. Without a
    time stamp an event comes `STEP_NS` after the one added before. A trace has one packet per
    CPU, which spans all its events, unless packets of it are added.
    """

    def __init__(self) -> None:
        self.sources: dict[int, Source] = {0: Source()}
        self.events: list[tuple[str, dict[str, Any]]] = []
        self._packets: dict[int, list[dict[str, Any]]] = defaultdict(list)
        # Traces that have nothing but readings.
        self.readers: set[int] = set()
        self.samples: list[tuple[str, bool, str, str]] = []
        self.usage: list[tuple[int, str, str]] = []
        self.now = 1_000

    def add(self, name: str, thread: Thread, /, *, ts: int | None = None, **fields: Any) -> int:
        """Add an event; fields left out are NULL. Returns its time stamp."""
        known = {field.name for field in _tracepoint(name).fields}
        if fields.keys() - known:
            raise ValueError(f"{name} has no field {', '.join(sorted(fields.keys() - known))}")
        self.now = self.now + STEP_NS if ts is None else ts
        self.events.append(
            (
                name,
                {
                    "ts_ns": self.now,
                    "trace_index": thread.trace,
                    "cpu_id": thread.cpu,
                    "vpid": thread.pid,
                    "vtid": thread.vtid,
                    "procname": thread.name,
                    "pid_ns": thread.pid_ns,
                    **fields,
                },
            )
        )
        return self.now

    def add_row(self, name: str, columns: Mapping[str, Any]) -> None:
        """Add an event of another system, as `ordered` returned it."""
        self.now = columns["ts_ns"]
        self.events.append((name, {k: v for k, v in columns.items() if k != "event_id"}))

    def wait(self, duration_ns: int) -> None:
        """Let time pass before the next event."""
        self.now += duration_ns

    def add_source(
        self,
        trace: int,
        hostname: str,
        clock: str,
        recording: str | None = None,
        path: str | None = None,
        tracer: str = Source.tracer,
        origin_ns: int = 0,
    ) -> None:
        """Add a trace, or change the one there is."""
        self.sources[trace] = Source(hostname, clock, recording, path, tracer, origin_ns)

    def add_sample(
        self, head: str, *stack: str, hostname: str = "alpha", is_monotonic: bool = True
    ) -> None:
        """Add a sample as perf writes it: its line, and those of its calls, the innermost first."""
        self.samples.append((hostname, is_monotonic, head, "\n".join(stack)))

    def add_usage(
        self, *lines: str, hostname: str = "alpha", boot: str = "", file: int = 0, cpus: int = 2
    ) -> None:
        """Add samples of the system: lines as msgflow record writes them, with spaces for tabs.

        Within a field, a + stands for a space.
        """
        head = f"msgflow+usage+1 {hostname} {boot} 100 {cpus} 4711+4712"
        is_known = any(one == file for one, *_ in self.usage)
        for line in lines if is_known else (head, *lines):
            text = line.replace(" ", "\t").replace("+", " ")
            self.usage.append((file, hostname, text))

    def add_packet(
        self,
        begin: int,
        end: int,
        *,
        last_event: int | None = None,
        count: int = 1,
        discarded: int = 0,
        lost_packets: int | None = 0,
        numbered: bool = True,
        cpu: int = 0,
        trace: int = 0,
    ) -> None:
        """Add a packet to the stream of a CPU; its last event is at its end unless given."""
        position = sum(packet["cpu_id"] == cpu for packet in self._packets[trace])
        self._packets[trace].append(
            {
                "trace_index": trace,
                "stream_index": cpu,
                "stream_class_id": 0,
                "stream_instance_id": cpu,
                "cpu_id": cpu,
                "position": position,
                "begin_ns": begin,
                "end_ns": end,
                "last_event_ns": (end if last_event is None else last_event) if count else None,
                "event_count": count,
                "discarded_event_count": discarded,
                "lost_packet_count": lost_packets,
                "is_numbered": numbered,
            }
        )

    def lose(self, *, cpu: int = 0, trace: int = 0, count: int = 5) -> None:
        """Declare that events are lost between the event added last and the next one added."""
        self.add_packet(
            self.now, self.now + 1, last_event=self.now, discarded=count, cpu=cpu, trace=trace
        )

    def ordered(self) -> list[tuple[str, dict[str, Any]]]:
        """Return (name, columns) of all events in their total order, with their `event_id`."""
        ordered = sorted(self.events, key=lambda event: event[1]["ts_ns"])
        return [(name, {"event_id": n, **row}) for n, (name, row) in enumerate(ordered)]

    def write(self, con: duckdb.DuckDBPyConnection) -> None:
        """Fill `raw` and `staging` as reading the traces would."""
        for index, source in sorted(self.sources.items()):
            con.execute(
                "INSERT INTO staging.source VALUES (?, ?, ?, ?, ?, ?, ?, ?, NULL, NULL, 0, ?)",
                [
                    index,
                    source.path or f"trace-{index}",
                    source.recording or f"uuid-{index}",
                    source.domain,
                    source.hostname,
                    source.tracer,
                    source.clock,
                    source.clock,
                    source.origin_ns,
                ],
            )
        for index in self.readers:
            con.execute("INSERT INTO staging.reader VALUES (?)", [index])
        rows: dict[str, list[dict[str, Any]]] = defaultdict(list)
        for name, row in self.ordered():
            rows[name].append(row)
        batches = []
        counts: list[tuple[int, str, int]] = []
        for name, events in rows.items():
            schema = pa.schema([*COMMON_SCHEMA, *_tracepoint(name).arrow_schema()])
            batches.append((name, pa.RecordBatch.from_pylist(events, schema=schema)))
            of_traces = Counter(event["trace_index"] for event in events)
            counts += [(trace, name, count) for trace, count in of_traces.items()]
        if counts:
            texts = [f"({trace}, '{name}', true, {count})" for trace, name, count in counts]
            con.execute(f"INSERT INTO staging.event_count VALUES {', '.join(texts)}")
            texts = [f"({trace}, '{name}')" for trace, name, _ in counts]
            con.execute(f"INSERT INTO staging.declared VALUES {', '.join(texts)}")
        packets = pa.RecordBatch.from_pylist(self._all_packets(), schema=PACKET_SCHEMA)
        self._read(con, batches, packets)
        corrections = overlapping_traces.corrections_of(con)
        if corrections:
            empty(con, "raw")
            self._read(con, [(n, corrections.applied(batch)) for n, batch in batches], packets)

    def _read(
        self,
        con: duckdb.DuckDBPyConnection,
        batches: list[tuple[str, pa.RecordBatch]],
        packets: pa.RecordBatch,
    ) -> None:
        batches = [(name, batch) for name, batch in batches if batch.num_rows]
        kernel = [(_tracepoint(n), batch) for n, batch in batches if _tracepoint(n).is_kernel]
        of_cpus = [(known, batch) for known, batch in kernel if known.role is not None]
        placed = Cpus(load()).place(of_cpus) if of_cpus else []
        placed += [without_thread(known, batch) for known, batch in kernel if known.role is None]
        of_threads = [(_tracepoint(n), b) for n, b in batches if not _tracepoint(n).is_kernel]
        if of_threads:
            hosts: dict[tuple[str, str], int] = {}
            sources = [self.sources.get(n, Source()) for n in range(max(self.sources) + 1)]
            numbers = [
                hosts.setdefault((source.hostname, source.clock), len(hosts)) for source in sources
            ]
            placed += Sequences(load(), numbers).place(of_threads)
        for table, rows in [*placed, ("packet", packets)]:
            _insert(con, f"raw.{table}", rows)
        for sample in self.samples:
            con.execute("INSERT INTO raw.stack_sample VALUES (?, ?, ?, ?)", sample)
        count: Counter[int] = Counter()
        for file, hostname, text in self.usage:
            line = [file, hostname, count[file], text]
            con.execute("INSERT INTO raw.usage VALUES (?, ?, ?, ?)", line)
            count[file] += 1

    def _all_packets(self) -> list[dict[str, Any]]:
        whole = StagedEvents()
        for trace in self.sources.keys() - self._packets.keys():
            rows = [row for _, row in self.events if row["trace_index"] == trace]
            for cpu in sorted({row["cpu_id"] for row in rows}):
                times = [row["ts_ns"] for row in rows if row["cpu_id"] == cpu]
                begin, end = min(r["ts_ns"] for r in rows), max(r["ts_ns"] for r in rows)
                whole.add_packet(
                    begin, end, last_event=max(times), count=len(times), cpu=cpu, trace=trace
                )
        packets = {**self._packets, **whole._packets}
        return [packet for trace in sorted(packets) for packet in packets[trace]]


def _tracepoint(name: str) -> Tracepoint:
    return {**load().tracepoints, **load().staged, READING.name: READING}[name]


def _insert(con: duckdb.DuckDBPyConnection, table: str, rows: pa.RecordBatch) -> None:
    database, _, name = table.partition(".")
    con.from_arrow(rows).insert_into(f"{database}.main.{name}")
