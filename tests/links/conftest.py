from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from support.analysis import Analysis
from support.ros_system import RosSystem
from support.staged_events import Thread

FUSION, RELAY = Thread(100, name="fusion"), Thread(200, name="relay")
TWINS = Thread(300, name="left"), Thread(400, name="right")


def make_system() -> RosSystem:
    """A fusion that keeps /a and /b until its timer publishes /c and /d, a relay, two twins."""
    system = RosSystem()
    system.node(FUSION, 0x1, "fusion")
    system.subscription(FUSION, 0x11, "/a", callback=0xC1)
    system.subscription(FUSION, 0x12, "/b", callback=0xC2)
    system.subscription(FUSION, 0x13, "/parameter_events", callback=0xC3)
    system.publisher(FUSION, 0x21, "/c")
    system.publisher(FUSION, 0x22, "/d")
    system.timer(FUSION, 0x31, 0xD1)
    system.node(RELAY, 0x1, "relay")
    system.subscription(RELAY, 0x11, "/c", callback=0xC1)
    system.publisher(RELAY, 0x21, "/a")
    system.publisher(RELAY, 0x22, "/c")
    for twin in TWINS:
        system.node(twin, 0x1, "twin", namespace="/ns")
        system.subscription(twin, 0x11, "/x", callback=0xC1)
        system.publisher(twin, 0x21, "/y")
    stamp = iter(range(1_000, 2_000))
    for _ in range(2):
        for handle, callback in ((0x11, 0xC1), (0x12, 0xC2)):
            system.take(FUSION, handle, next(stamp))
            system.start(FUSION, callback)
            system.end(FUSION, callback)
        system.start(FUSION, 0xD1)
        for handle in (0x21, 0x22):
            system.publish(FUSION, handle, next(stamp))
        system.end(FUSION, 0xD1)
    return system


@pytest.fixture(scope="session")
def made(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("links")
    analysis = Analysis(empty_database, directory)
    analysis.build(make_system())
    analysis.close()
    return directory / "analysis.duckdb"


@pytest.fixture
def database(made: Path, tmp_path: Path) -> Path:
    """A copy of a database with the system of `make_system`."""
    path = tmp_path / "links.duckdb"
    shutil.copyfile(made, path)
    return path
