"""Simulations shared by the tests, and bt2 to read what they have written."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import duckdb
import pytest
from support.robots import robot
from support.thorough import few

from msgflow.errors import TraceError
from msgflow.trace import bt2_library
from msgflow_sim import (
    Host,
    Node,
    Publisher,
    Scenario,
    Simulation,
    Subscription,
    Timer,
    Work,
    scenarios,
    simulate,
)

_LENGTH = 0.15
# Some things happen only later in a scenario.
_LENGTHS = {
    # The detector is slow now and then.
    "demo": 0.3,
    # Nothing is lost before.
    "kernel_losses": 0.1,
    "losses": 0.7,
    "restarts": 0.9,
    "container_restarts": 0.9,
    "mixed_intra_process": 0.5,
    "services": 0.4,
}
BASIC = ("pipeline", "fan_out", "two_hosts", "demo")


@dataclass(frozen=True, slots=True)
class ReadEvent:
    """One event as bt2 has read it; `fields` are the payload."""

    ts_ns: int
    name: str
    host: str
    cpu: int
    pid: int
    tid: int
    procname: str
    fields: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Recording:
    """A simulation and its events in the order of time."""

    simulation: Simulation
    events: tuple[ReadEvent, ...]

    @property
    def meta(self) -> dict[str, Any]:
        return json.loads(self.simulation.meta.read_text())

    def truth(self, sql: str) -> list[tuple[Any, ...]]:
        """Rows of a query over the truth tables."""
        return _truth(self.simulation.directory).execute(sql).fetchall()


@cache
def _truth(directory: Path) -> duckdb.DuckDBPyConnection:
    connection = duckdb.connect()
    for path in (directory / "truth").glob("*.parquet"):
        connection.execute(f"CREATE TABLE {path.stem} AS FROM '{path}'")
    return connection


@pytest.fixture(scope="session")
def bt2() -> ModuleType:
    """Babeltrace 2's bindings, also from outside a virtual environment."""
    try:
        return bt2_library.load()
    except TraceError as error:
        pytest.skip(error.message)


def read_events(bt2: ModuleType, directory: Path) -> tuple[ReadEvent, ...]:
    """All ROS events below a directory; fails on anything that babeltrace 2 complains about."""
    events = []
    for message in bt2.TraceCollectionMessageIterator(str(directory)):
        kind = type(message).__name__
        assert "Discarded" not in kind, "events or packets are missing"
        if kind != "_EventMessageConst":
            continue
        event = message.event
        if event.stream.trace.environment["domain"] == "kernel":
            continue
        context = event.common_context_field
        events.append(
            ReadEvent(
                message.default_clock_snapshot.ns_from_origin,
                event.name,
                str(event.stream.trace.environment["hostname"]),
                int(event.packet.context_field["cpu_id"]),
                int(context["vpid"]),
                int(context["vtid"]),
                str(context["procname"]),
                {name: _plain(value) for name, value in event.payload_field.items()},
            )
        )
    return tuple(events)


def _plain(value: Any) -> Any:
    if "String" in type(value).__name__:
        # bt2 2.0.4 shows the text of an earlier field instead of an empty one.
        return str(value) if len(value) else ""
    if "DynamicArray" in type(value).__name__:
        return tuple(int(element) for element in value)
    if "Array" in type(value).__name__:
        return bytes(int(element) for element in value)
    return int(value)


@pytest.fixture(scope="session")
def recordings(bt2: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Recording]:
    """Every built-in scenario, simulated and read once it is asked for."""
    directory = tmp_path_factory.mktemp("sim")

    class Recordings(dict[str, Recording]):
        def __missing__(self, name: str) -> Recording:
            factor = _LENGTHS.get(name, _LENGTH)
            simulation = simulate(name, directory / name, factor=factor)
            self[name] = Recording(simulation, read_events(bt2, simulation.directory))
            return self[name]

    return Recordings()


# Of containers with equal ids nobody can say by ids which process an event is of.
_KNOWN_BY_IDS = [name for name in scenarios() if not name.startswith("containers_")]


@pytest.fixture(params=few(_KNOWN_BY_IDS, "demo", "mixed_intra_process"))
def recording(request: pytest.FixtureRequest, recordings: dict[str, Recording]) -> Recording:
    """Each built-in scenario in turn whose processes have ids of their own."""
    return recordings[request.param]


@pytest.fixture(scope="session")
def recorded_jazzy() -> Path:
    """A trace of the Jazzy layout that LTTng has recorded."""
    path = Path(__file__).parents[3] / "shared" / "traces" / "periodic_async_jazzy24"
    if not path.is_dir():
        pytest.skip("the recorded traces (../shared/traces) are not here")
    return path


@pytest.fixture(params=few(BASIC, "demo"))
def basic(request: pytest.FixtureRequest, recordings: dict[str, Recording]) -> Recording:
    """Each scenario of plain executors, typed messages and queues that never are full."""
    return recordings[request.param]


@pytest.fixture
def read(bt2: ModuleType) -> Callable[[Simulation], Recording]:
    """Reads the events of a simulation."""
    return lambda simulation: Recording(simulation, read_events(bt2, simulation.directory))


@pytest.fixture
def quiet() -> Scenario:
    """Two processes that hardly say anything: one message in ten seconds."""
    talker = Node(
        "talker",
        publishers=(Publisher("/seldom"),),
        timers=(Timer(10 * 1_000_000_000, publishes=("/seldom",)),),
    )
    listener = Node("listener", subscriptions=(Subscription("/seldom"),))
    return robot(
        talker,
        listener,
        name="quiet",
        hosts=(Host("robot", cpu_count=1),),
        duration_ns=35 * 1_000_000_000,
    )


@pytest.fixture
def overloaded() -> Scenario:
    """A subscription with a queue of three that is four times slower than what it hears."""
    talker = Node(
        "talker",
        publishers=(Publisher("/fast"),),
        timers=(Timer(1_000_000, publishes=("/fast",)),),
    )
    listener = Node(
        "listener",
        subscriptions=(Subscription("/fast", work=Work(4_000_000), depth=3),),
    )
    return robot(talker, listener, name="overloaded", duration_ns=1_000_000_000, overwrites=True)


@pytest.fixture
def burst() -> Scenario:
    """Each callback publishes five times at once, faster than messages differ in latency."""
    topic = "/burst"
    talker = Node(
        "talker",
        publishers=(Publisher(topic),),
        timers=(Timer(5_000_000, publishes=(topic,) * 5),),
    )
    listener = Node("listener", subscriptions=(Subscription(topic),))
    return robot(talker, listener, name="burst", duration_ns=1_000_000_000)
