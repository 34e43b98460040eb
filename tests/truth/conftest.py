"""Ingests shared by all comparisons: each trace is read once."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import pytest
from support.ingested import Ingested, made_once, open_ingested
from support.thorough import SHOWN, few

from msgflow.ingest import ingest
from msgflow_sim import scenarios, simulate
from msgflow_sim.entity import SECOND

_LENGTH = 0.05
# Scenarios that are shorter than others, or in which things happen late.
_LENGTHS = {
    "losses": 0.7,
    "restarts": 0.9,
    "container_restarts": 0.9,
    "services": 0.4,
    "timers": 0.6,
    "mixed_intra_process": 0.5,
    "autoware": 0.2,
    "autoware_two_threads": 0.2,
    "rtabmap": 0.2,
}
_SHORT = 0.15
# Flows in them pass ring buffers, messages taken without a callback, or calls of services.
_WITH_GAPS = (
    "agnocast",
    "intra_process",
    "mixed_intra_process",
    "overwritten_copies",
    "container",
    "container_multi_threaded",
    "python",
    "python_timers",
    "layers",
    "services",
    "calls",
)
_WITHOUT_FLOWS = ("timers", "actions")
# Which run filled a cache, and so which flow a message is on, is a guess in these.
_DOUBTFUL = ("reentrant",)
# An open database has threads and memory of its own: those before the last few are closed.
_MOST_OPEN = 3


@pytest.fixture(scope="session")
def simulations(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Ingested]:
    """Simulates and ingests a scenario; what is true of it are the views truth_<table>."""

    @lru_cache(_MOST_OPEN)
    def get(name: str) -> Ingested:
        def make(path: Path) -> None:
            is_long = scenarios()[name].duration_ns >= 10 * SECOND
            factor = _LENGTHS.get(name, _LENGTH if is_long else _SHORT)
            ingest([simulate(name, path.parent / name, factor=factor).directory], path)

        path = made_once(tmp_path_factory, f"true_{name}", make)
        ingested = open_ingested(path)
        for file in (path.parent / name / "truth").glob("*.parquet"):
            ingested.connection.execute(f"CREATE TEMP VIEW truth_{file.stem} AS FROM '{file}'")
        return ingested

    return get


@pytest.fixture(params=few(scenarios(), *SHOWN))
def simulated(request: pytest.FixtureRequest, simulations: Callable[[str], Ingested]) -> Ingested:
    """Each built-in scenario in turn."""
    return simulations(request.param)


_COMPLETE = [name for name in scenarios() if name not in (*_WITH_GAPS, *_DOUBTFUL, *_WITHOUT_FLOWS)]


@pytest.fixture(params=few(_COMPLETE, *(name for name in SHOWN if name in _COMPLETE)))
def complete(request: pytest.FixtureRequest, simulations: Callable[[str], Ingested]) -> Ingested:
    """Each built-in scenario whose messages all go from rmw_publish to rmw_take to a callback."""
    return simulations(request.param)


@pytest.fixture(scope="session")
def recordings(real: Callable[[str], Path]) -> Callable[[str], Ingested]:
    """Opens the database of one of the recorded traces, by its path in the folder of all."""
    return lru_cache(_MOST_OPEN)(lambda name: open_ingested(real(name)))
