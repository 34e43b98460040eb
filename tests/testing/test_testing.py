"""What tests of a robot can ask, and what happens where nothing can be recorded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from msgflow.errors import UsageError
from msgflow.testing import RecordedDatabase, ms, msgflow_recorded

__all__ = ["msgflow_recorded"]


def test_latency_from_topic_to_topic(simulated: Callable[..., Path]) -> None:
    with RecordedDatabase(simulated("demo", 0.1)) as database:
        latency = database.e2e("/camera/image", "/base/motors")
        (row,) = (
            database.query("e2e-latency", by="ends", from_="/camera/image", to="/base/motors")
            .to_arrow()
            .to_pylist()
        )
        assert (latency.p50, latency.p99) == (row["first_median_ns"], row["first_p99_ns"])
        assert 0 < latency.reached <= latency.roots
        assert ms(0.5) < latency.p50 <= latency.p95 <= latency.p99 <= latency.max
        with pytest.raises(AssertionError, match="nothing from /base/motors arrived at /camera"):
            database.e2e("/base/motors", "/camera/image")
        with pytest.raises(UsageError, match="there is no such topic or node"):
            database.e2e("/camera/image", "/no/motors")


def test_without_lttng_a_test_is_skipped(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(pytest.skip.Exception, match="lttng is not installed"):
        request.getfixturevalue("msgflow_recorded")
