"""How what is asked of a database grows with it: seconds and memory of two sizes, and their ratio.

    python benchmarks/scaling.py [--events 1000000 10000000 | --trace DIR DIR]
                                 [--system pipeline] [--loop-messages 100000] [--markdown FILE]

Ingests a simulated system (`msgflow simulate --list`) in two sizes, then measures in processes of
their own: deriving all links anew, the edges of all flows as a table, and the queries that go
through all paths or one flow. Linear work takes as many times longer as there are more events.

Then flows through systems whose messages cause each other in a loop: all messages of a ping-pong,
and of a controller that the effect of its own commands comes back to, are one flow.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import tempfile
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from run import INGEST, run

from msgflow.sim import (
    Host,
    MessageLink,
    Node,
    Process,
    Publisher,
    Scenario,
    Subscription,
    Timer,
    scenarios,
    simulate,
)
from msgflow.sim.entity import MILLISECOND, SECOND

if TYPE_CHECKING:
    from collections.abc import Mapping

DERIVE = """
import json, sys, time; from pathlib import Path
from msgflow.db.connection import connect
from msgflow.db.derive import derive
con = connect(Path(sys.argv[1]), read_only=False)
begin = time.monotonic(); con.begin(); derive(con, 1); con.commit()
count = "SELECT (SELECT count(*) FROM link_transport) + (SELECT count(*) FROM link_causal)"
print(json.dumps([time.monotonic() - begin, con.execute(count).fetchall()[0][0]]))
"""

QUERY = """
import json, sys, time; import msgflow
with msgflow.open_db(sys.argv[1]) as database:
    begin = time.monotonic(); table = database.query(sys.argv[2]).to_arrow()
    print(json.dumps([time.monotonic() - begin, table.num_rows]))
"""

# Of a query that ends with the vertex to start from, the rows of a table function or view.
TABLE = """
import json, sys, time; from pathlib import Path
from msgflow.db.connection import connect
con = connect(Path(sys.argv[1]), read_only=True)
start = con.execute(sys.argv[3]).fetchall()[0] if len(sys.argv) > 3 else []
begin = time.monotonic(); con.execute(f"CREATE TEMP TABLE x AS FROM {sys.argv[2]}", start)
seconds = time.monotonic() - begin
print(json.dumps([seconds, con.execute("SELECT count(*) FROM x").fetchall()[0][0]]))
"""

QUERIES = ("e2e-latency", "reaction-time", "data-age", "path-breakdown", "critical-path")
LOOP_TOPICS = ("/ping", "/state")


@dataclass(frozen=True)
class Cost:
    """Wall time [s], peak memory of the process [bytes] and rows of a result."""

    seconds: float
    peak_bytes: int
    rows: int


def measure(code: str, *arguments: str) -> Cost:
    """Run code in a process of its own; it prints its seconds and rows."""
    output, sample = run(sys.executable, "-c", code, *arguments)
    seconds, rows = json.loads(output)
    return Cost(seconds, sample.peak_bytes, rows)


def ingest(trace: Path, database: Path) -> int:
    """Ingest a trace in a process of its own; return its number of events."""
    output, _ = run(sys.executable, "-c", INGEST, str(trace), str(database), "")
    return int(json.loads(output)[0])


def ask(database: Path) -> dict[str, Cost]:
    """Measure everything that is asked of one database."""
    path = str(database)
    return {
        "links, derived anew": measure(DERIVE, path),
        "flow_edge as a table": measure(TABLE, path, "flow_edge"),
        **{f"query {name}": measure(QUERY, path, name) for name in QUERIES},
    }


def follow(database: Path) -> dict[str, Cost]:
    """Measure the flows from the first and to the last message of the loop."""
    path = str(database)
    first, last = (
        f"SELECT {end}(publication_id) FROM link_transport JOIN publication USING (publication_id) "
        f"JOIN publisher USING (publisher_id) WHERE topic_name IN {LOOP_TOPICS}"
        for end in ("min", "max")
    )
    return {
        "forward": measure(TABLE, path, "flow_forward('publication', ?)", first),
        "backward": measure(TABLE, path, "flow_backward('publication', ?)", last),
        "query e2e-latency": measure(QUERY, path, "e2e-latency"),
    }


def ping_pong(duration_ns: int) -> Scenario:
    """Two nodes that pass one message to each other, from the middle of the time on."""
    start = Node(
        "start",
        publishers=(Publisher("/ping"),),
        timers=(Timer(duration_ns * 6 // 10, ("/ping",)),),
    )
    players = (
        Node(name, publishers=(Publisher(to),), subscriptions=(Subscription(at, (to,)),))
        for name, at, to in (("left", "/ping", "/pong"), ("right", "/pong", "/ping"))
    )
    return _scenario("ping-pong", (*players, start), duration_ns)


def feedback(duration_ns: int) -> Scenario:
    """A timer that uses the latest state, which its own commands bring about."""
    controller = Node(
        "controller",
        publishers=(Publisher("/command"),),
        subscriptions=(Subscription("/state"),),
        timers=(Timer(MILLISECOND, ("/command",)),),
        links=(MessageLink("periodic_async", ("/state",), ("/command",)),),
    )
    plant = Node(
        "plant",
        publishers=(Publisher("/state"),),
        subscriptions=(Subscription("/command", ("/state",)),),
    )
    return _scenario("feedback loop", (plant, controller), duration_ns)


def _scenario(name: str, nodes: tuple[Node, ...], duration_ns: int) -> Scenario:
    return Scenario(
        name=name,
        description="Messages that cause each other in a loop.",
        hosts=(Host("alpha", cpu_count=len(nodes) + 1),),
        processes=tuple(
            Process(node.name, "alpha", 1101 + 100 * n, (node,), start_ns=n * MILLISECOND)
            for n, node in enumerate(nodes)
        ),
        duration_ns=duration_ns,
        layout="rolling",
    )


def build_loop(kind: str, messages: int, directory: Path) -> tuple[Path, int]:
    """Simulate and ingest a loop of about as many messages; return database and messages."""
    make = {"ping-pong": ping_pong, "feedback loop": feedback}[kind]
    probe = json.loads(simulate(make(SECOND), directory / "probe").meta.read_text())
    duration_ns = SECOND * messages // probe["rows"]["causal"]
    whole = json.loads(simulate(make(duration_ns), directory / "trace").meta.read_text())
    database = directory / "loop.duckdb"
    ingest(directory / "trace", database)
    return database, whole["rows"]["causal"]


def build(system: str, events: int, directory: Path) -> Path:
    """Simulate a system with about as many events; return the directory of its traces."""
    scenario = scenarios()[system]
    probe = simulate(scenario, directory / "probe", factor=1)
    simulate(scenario, directory / "trace", factor=events / probe.event_count)
    return directory / "trace"


def compared(costs: list[dict[str, Cost]], events: list[int]) -> list[str]:
    """Return the lines of a Markdown table of both sizes."""
    lines = [
        f"| | {' | '.join(f'{count:,} events' for count in events)} | ratio | peak memory |",
        "| --- | ---: | ---: | ---: | ---: |",
        f"| events |  |  | {events[1] / events[0]:.1f} |  |",
    ]
    for name, small in costs[0].items():
        large = costs[1][name]
        lines.append(
            f"| {name} ({small.rows:,} and {large.rows:,} rows) | {small.seconds:.2f} s "
            f"| {large.seconds:.2f} s | {large.seconds / small.seconds:.1f} "
            f"| {small.peak_bytes / 1e6:,.0f} and {large.peak_bytes / 1e6:,.0f} MB |"
        )
    return lines


def listed(loops: Mapping[str, dict[str, Cost]]) -> list[str]:
    """Return the lines of a Markdown table of the loops."""
    lines = ["| | rows | seconds | peak memory |", "| --- | ---: | ---: | ---: |"]
    for loop, costs in loops.items():
        lines += [
            f"| {loop}: {name} | {cost.rows:,} | {cost.seconds:.2f} "
            f"| {cost.peak_bytes / 1e6:,.0f} MB |"
            for name, cost in costs.items()
        ]
    return lines


def main() -> None:
    """Simulate, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--events", type=int, nargs=2, default=[1_000_000, 10_000_000])
    parser.add_argument("--system", default="pipeline", help="what is simulated")
    parser.add_argument("--trace", nargs=2, type=Path, help="a small and a large trace instead")
    parser.add_argument("--loop-messages", type=int, default=100_000)
    parser.add_argument("--markdown", type=Path, help="append the tables to this file")
    arguments = parser.parse_args()
    costs, events, loops = [], [], {}
    for size in range(2):
        with tempfile.TemporaryDirectory() as directory:
            place = Path(directory)
            trace = (
                arguments.trace[size]
                if arguments.trace
                else build(arguments.system, arguments.events[size], place)
            )
            events.append(ingest(trace, place / "scaling.duckdb"))
            costs.append(ask(place / "scaling.duckdb"))
    for kind in ("ping-pong", "feedback loop"):
        with tempfile.TemporaryDirectory() as directory:
            database, messages = build_loop(kind, arguments.loop_messages, Path(directory))
            loops[f"{kind} of {messages:,} messages"] = follow(database)
    text = "\n".join(
        [
            f"{datetime.now(UTC):%Y-%m-%d}: {os.cpu_count()} cores ({platform.machine()}), Python "
            f"{platform.python_version()}, load {os.getloadavg()[0]:.1f} at the end.",
            "",
            *compared(costs, events),
            "",
            *listed(loops),
        ]
    )
    print(text)
    if arguments.markdown:
        with arguments.markdown.open("a") as stream:
            stream.write(f"\n{text}\n")


if __name__ == "__main__":
    main()
