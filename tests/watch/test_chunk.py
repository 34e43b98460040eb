"""Finding chunks: each once, whatever else is below the directory."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from msgflow.errors import TraceError
from msgflow.watch import chunk as chunk_module
from msgflow.watch.chunk import Chunk, ChunkFinder, finished_chunks


def make(session: Path, number: int, begin: int = 0, length: int = 2) -> Path:
    """Make an empty chunk that begins so many seconds after a full minute."""
    times = [f"20260314T0926{second:02}+0100" for second in (begin, begin + length)]
    path = session / "archives" / f"{times[0]}-{times[1]}-{number}"
    path.mkdir(parents=True)
    return path


def numbers(chunks: list[Chunk]) -> list[int]:
    return [chunk.number for chunk in chunks]


@pytest.fixture
def errors() -> list[TraceError]:
    return []


@pytest.fixture
def finder(
    tmp_path: Path, errors: list[TraceError], monkeypatch: pytest.MonkeyPatch
) -> ChunkFinder:
    monkeypatch.setattr(chunk_module, "_BETWEEN_SEARCHES", 0)
    monkeypatch.setattr(chunk_module, "_MOST_OF_TIME", float("inf"))
    return ChunkFinder(tmp_path, errors.append)


def test_each_chunk_is_found_once(finder: ChunkFinder, tmp_path: Path) -> None:
    make(tmp_path / "a", 1, 2)
    make(tmp_path / "a", 0)
    make(tmp_path / "b", 0)
    found = finder.further()
    assert [(each.number, each.source.name) for each in found] == [(0, "a"), (0, "b"), (1, "a")]
    assert found[0].length_s == 2
    (tmp_path / "a" / "archives" / "unfinished").mkdir()
    assert finder.further() == []
    make(tmp_path / "a", 2, 4)
    make(tmp_path / "c", 7)
    assert numbers(finder.further()) == [2]
    make(tmp_path / "c", 8, 2)
    assert numbers(finder.further()) == [7, 8]


def test_a_session_created_anew_begins_with_number_0(finder: ChunkFinder, tmp_path: Path) -> None:
    for number in (0, 1, 2):
        make(tmp_path, number, 2 * number)
    assert numbers(finder.further()) == [0, 1, 2]
    for number in (0, 1, 2, 3):
        make(tmp_path, number, 10 + 2 * number)
    assert numbers(finder.further()) == [0, 1, 2, 3]
    # What comes late finds both.
    found = finished_chunks(tmp_path)
    assert numbers(found) == [0, 1, 2, 0, 1, 2, 3]
    assert [path.path.name[13:15] for path in found] == ["00", "02", "04", "10", "12", "14", "16"]


def test_a_clock_that_is_set_does_not_mix_up_chunks(tmp_path: Path) -> None:
    for number in (0, 1, 2):
        make(tmp_path, number, 40 - 10 * number)
    assert numbers(finished_chunks(tmp_path)) == [0, 1, 2]


def test_what_is_no_chunk_of_the_session_is_left_out(finder: ChunkFinder, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    for number in (0, 1):
        make(tmp_path, number, 2 * number)
    make(tmp_path, 99_999, 5)
    archives = tmp_path / "archives"
    (archives / "99999999T999999+9999-20260314T092600+0100-2").mkdir()
    (archives / "20260314T092604+0100-20260314T092606+0100-2").symlink_to(tmp_path / "elsewhere")
    (archives / "20260314T092606+0100-20260314T092608+0100-3").touch()
    assert numbers(finder.further()) == [0, 1]
    # There was time for so many: in years to come, or at four in a second.
    (archives / "20990314T092604+0100-20990314T092606+0100-77").mkdir()
    make(tmp_path, 17, 8)
    # The next one is not earlier than the last, and a recording that is made anew goes on.
    make(tmp_path, 2, 1)
    make(tmp_path, 0, 20)
    assert numbers(finder.further()) == []
    make(tmp_path, 2, 3)
    assert numbers(finder.further()) == [2]
    make(tmp_path, 3, 5)
    assert numbers(finder.further(is_last=True)) == [3, 17, 0]


def test_a_gap_is_believed_when_the_recording_goes_on_behind_it(
    finder: ChunkFinder, tmp_path: Path
) -> None:
    make(tmp_path, 0, 30)
    assert numbers(finder.further()) == [0]
    # The clock was set back, and chunks are missing.
    make(tmp_path, 7, 0)
    assert numbers(finder.further()) == []
    make(tmp_path, 8, 2)
    make(tmp_path, 9, 4)
    assert numbers(finder.further()) == [7, 8, 9]


def test_a_directory_that_is_replaced(finder: ChunkFinder, tmp_path: Path) -> None:
    path = make(tmp_path, 0)
    assert numbers(finder.further()) == [0]
    path.rmdir()
    path.parent.rmdir()
    assert finder.further() == []
    make(tmp_path, 0, 20)
    assert numbers(finder.further()) == [0]


def test_old_recordings_are_searched_seldom(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches = 0
    walk = os.walk

    def counted(*words: object, **more: object) -> object:
        nonlocal searches
        searches += 1
        return walk(*words, **more)  # type: ignore[call-overload]

    monkeypatch.setattr(os, "walk", counted)
    finder = ChunkFinder(tmp_path, lambda error: None)
    make(tmp_path, 0)
    for _ in range(5):
        finder.further()
    make(tmp_path, 1, 2)
    assert numbers(finder.further()) == [1]
    assert searches == 1


@pytest.mark.skipif(os.getuid() == 0, reason="root reads everything")
def test_what_root_may_read_only(
    finder: ChunkFinder, errors: list[TraceError], tmp_path: Path
) -> None:
    """As directories of an lttng-relayd that another user runs."""
    make(tmp_path / "host", 0)
    make(tmp_path / "open", 0).chmod(0)
    (tmp_path / "host").chmod(0)
    for _ in range(3):
        assert finder.further() == []
    (tmp_path / "host").chmod(0o700)
    assert [error.message for error in errors] == [
        f"cannot read {tmp_path}/host: permission denied",
        f"cannot read {tmp_path}/open/archives: permission denied",
    ]


def test_what_cannot_be_read_is_said_once(
    finder: ChunkFinder, errors: list[TraceError], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = make(tmp_path, 0)
    scandir = os.scandir

    def refuse(place: str) -> object:
        if str(place) == str(tmp_path):
            raise PermissionError(13, "Permission denied", str(place))
        return scandir(place)

    monkeypatch.setattr(os, "scandir", refuse)
    for _ in range(3):
        assert finder.further() == []
    (said,) = errors
    assert said.message == f"cannot read {tmp_path}: permission denied"
    assert said.hint is not None
    with pytest.raises(TraceError, match="permission denied"):
        finished_chunks(tmp_path)
    monkeypatch.setattr(os, "scandir", scandir)
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert finder.further() == []
    assert [error.message for error in errors][1:] == [
        f"cannot read {path.parent}: permission denied"
    ]
