"""Recorded traces: the same as through bt2, and the same again as CTF 2."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.ctf2_metadata import translate
from support.same_batches import differences, read
from support.thorough import few

from msgflow.ingest import catalogue
from msgflow.trace import discover

RECORDED = (
    "tracecompass-ros2",
    "sync_1_1",
    "sync_1_1_humble",
    "sync_1_1_jazzy",
    "pingpong",
    "periodic_async_jazzy24",
    "partial_sync",
    "services",
)


@pytest.mark.parametrize("name", few(RECORDED, "services"))
def test_as_bt2(shared_traces: Path, bt2_bindings: Any, name: str) -> None:
    path = shared_traces / name
    ours = read(path)
    assert not ours.damages
    assert not differences(ours, read(path, reader="bt2"))


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(["tracecompass-ros2", "pingpong"], "pingpong"))
def test_wanted_columns_as_bt2(shared_traces: Path, bt2_bindings: Any, name: str) -> None:
    wanted = catalogue.load().arrow_schemas()
    path = shared_traces / name
    ours = read(path, wanted=wanted, batch_rows=5000)
    assert not differences(ours, read(path, reader="bt2", wanted=wanted))


@pytest.mark.parametrize("name", few(RECORDED, "services"))
def test_as_ctf2(shared_traces: Path, copy_of: Callable[[str], Path], name: str) -> None:
    copy = copy_of(name)
    for location in discover([copy]):
        translate(location.path)
    original, translated = read(shared_traces / name), read(copy)
    for one, other in zip(original.traces, translated.traces, strict=True):
        assert dataclasses.replace(one, path=other.path) == other
    assert not differences(dataclasses.replace(original, traces=translated.traces), translated)


@pytest.mark.thorough
def test_perf_as_bt2(shared_kernel: Path, bt2_bindings: Any) -> None:
    path = shared_kernel / "public" / "perf-taskset2"
    ours = read(path)
    assert not ours.damages
    assert not differences(ours, read(path, reader="bt2"))


def test_perf_is_read_in_columns(shared_kernel: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its numbers have an alignment of one bit, and lie on whole bytes all the same."""
    path = shared_kernel / "public" / "perf-taskset2"
    with monkeypatch.context() as patch:
        patch.delattr("msgflow.trace.ctf.field_reader.EventReader.event_end")
        patch.delattr("msgflow.trace.ctf.batches.event_reader_of")
        assert read(path).event_counts
