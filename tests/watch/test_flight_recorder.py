"""The flight recorder where it fails: it says so, and the view goes on."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from msgflow.watch import flight_recorder
from msgflow.watch.flight_recorder import FlightRecorder

_SECOND_NS = 1_000_000_000


def _fails(*words: object, **options: object) -> None:
    raise RuntimeError("can't start new thread")


def recording(directory: Path) -> tuple[FlightRecorder, Path, list[str]]:
    """Return a recorder into `kept`, an empty chunk, and what the recorder notes."""
    chunk = directory / "drive" / "archives" / "0"
    chunk.mkdir(parents=True)
    notes: list[str] = []
    recorder = FlightRecorder(
        directory / "kept",
        most=5,
        window_ns=_SECOND_NS,
        earlier_ns=0,
        clock_sync="none",
        note=notes.append,
    )
    return recorder, chunk, notes


@pytest.mark.parametrize("place", ["a thread", "the database"])
def test_what_nobody_foresaw_is_a_note(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    if place == "a thread":
        monkeypatch.setattr(ThreadPoolExecutor, "submit", _fails)
    else:
        monkeypatch.setattr(flight_recorder, "ingest", _fails)
    recorder, chunk, notes = recording(tmp_path)
    for second in (0, 2):
        recorder.keep(second * _SECOND_NS, None, [chunk], None, None)  # type: ignore[arg-type]
    recorder.close()
    assert [note.partition(" in ")[0] for note in notes] == ["the violation is not kept"] * 2
    assert all(note.endswith(": RuntimeError: can't start new thread") for note in notes)
    assert not list((tmp_path / "kept").iterdir())


def test_a_link_that_leads_nowhere_is_a_note(tmp_path: Path) -> None:
    (tmp_path / "kept").symlink_to(tmp_path / "gone")
    recorder, chunk, notes = recording(tmp_path)
    recorder.keep(0, None, [chunk], None, None)  # type: ignore[arg-type]
    recorder.close()
    assert [note.partition(": ")[2].partition(";")[0] for note in notes] == ["file exists"]
