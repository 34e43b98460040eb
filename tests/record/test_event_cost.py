"""What an event costs, measured with the real LTTng before a recording."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from recording.recorder import NotPossibleError, require_lttng
from recording.tracetools import build_tracetools

from msgflow.record.daemon import session_daemon
from msgflow.record.event_cost import event_cost_ns, measure_event_cost
from msgflow.record.lttng import sessions
from msgflow.record.session import Channel

CHANNEL = Channel(("ros2:*",), "1M", 4)


def test_it_is_not_known_without_the_library(tmp_path: Path) -> None:
    measure_event_cost(tmp_path, CHANNEL)
    assert list(tmp_path.iterdir()) == []
    assert event_cost_ns([str(tmp_path)]) is None


def test_a_pipe_beside_a_trace_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "event-cost-ns").write_text("146\n")
    assert event_cost_ns([str(tmp_path / "ust")]) == 146
    (tmp_path / "event-cost-ns").unlink()
    os.mkfifo(tmp_path / "event-cost-ns")
    assert event_cost_ns([str(tmp_path / "ust")]) is None


@pytest.mark.thorough
def test_it_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        require_lttng()
        library = build_tracetools(tmp_path)
    except (NotPossibleError, subprocess.CalledProcessError) as error:
        pytest.skip(f"cannot record: {error}")
    monkeypatch.setenv("LD_LIBRARY_PATH", str(library.parent))
    with session_daemon(with_kernel=False, note=print):
        before = sessions()
        measure_event_cost(tmp_path, CHANNEL)
        assert sessions() == before
    cost = event_cost_ns([str(tmp_path / "ust" / "uid" / "0" / "64-bit")])
    assert cost is not None
    assert 20 < cost < 20_000
