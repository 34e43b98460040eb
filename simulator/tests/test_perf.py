"""Traces of a kernel as perf writes them."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

import msgflow.trace
from msgflow.errors import UsageError
from msgflow_sim import Recording, simulate
from msgflow_sim.events import PERF_NAMES

_EVENT = re.compile(r"event \{\s+id = \d+;\s+name = \"([^\"]+)\";(.*?)\n\};", re.DOTALL)
# What differs from trace to trace.
_OWN = re.compile(r'(uuid|host|release|version) = "[^"]*"')


def declared(metadata: Path) -> tuple[str, dict[str, str]]:
    """The metadata up to the events, and these by name."""
    text = metadata.read_text()
    return _OWN.sub(r"\1", text[: text.index("event {")]), dict(_EVENT.findall(text))


def counts(directory: Path) -> Counter[str]:
    """How often each event is read."""
    found: Counter[str] = Counter()
    with msgflow.trace.open([directory]) as traces:
        names = {name: None for trace in traces.traces for name in trace.event_names}
        for batch in traces.batches(dict.fromkeys(names)):
            found[batch.name] += batch.batch.num_rows
    return found


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Traces of the kernel by both tracers, of the same."""
    directory = tmp_path_factory.mktemp("traced")
    return {
        tracer: simulate(
            "shared_memory",
            directory / tracer,
            factor=0.1,
            recording=Recording(kernel_tracer=tracer),
        ).directory
        / "robot"
        for tracer in ("lttng", "perf")
    }


def test_metadata_is_as_in_a_recording(robot: dict[str, Path], shared_kernel: Path) -> None:
    preamble, events = declared(robot["perf"] / "perf" / "metadata")
    recorded_preamble, recorded = declared(shared_kernel / "cond" / "perf" / "metadata")
    assert preamble == recorded_preamble
    assert events.keys() == {*PERF_NAMES.values()} <= recorded.keys()
    for name, fields in events.items():
        assert fields == recorded[name]


def test_both_tracers_have_the_same_events(robot: dict[str, Path]) -> None:
    lttng, perf = counts(robot["lttng"] / "kernel"), counts(robot["perf"] / "perf")
    for name, of_perf in PERF_NAMES.items():
        assert lttng[name] == perf[of_perf]
    assert lttng["irq_handler_entry"] == lttng["irq_handler_exit"] > 10
    assert lttng["sched_switch"] > 100


def test_ros_is_recorded_alike(robot: dict[str, Path]) -> None:
    one, other = (
        {file.relative_to(path): file.read_bytes() for file in path.glob("ust/**/*_?")}
        for path in robot.values()
    )
    assert one == other


def test_a_tracer_that_is_unknown_is_refused() -> None:
    with pytest.raises(UsageError, match="unknown tracer of the kernel — ftrace"):
        Recording(kernel_tracer="ftrace")
