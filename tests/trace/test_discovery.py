from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace
from msgflow.errors import ExitCode, TraceError
from msgflow.trace import discover
from msgflow.trace.discovery import archives_below

CONTENT = TraceContent(events={"ros2:x": {}}, streams={0: [Packet([Event(1, "ros2:x")])]})


def fails(paths: list[Path], message: str, hint: str) -> None:
    with pytest.raises(TraceError, match=message) as caught:
        discover(paths)
    assert caught.value.exit_code is ExitCode.TRACE
    assert caught.value.hint is not None
    assert re.search(hint, caught.value.hint)
    assert not caught.value.message.endswith(".")


def test_finds_every_trace_below_in_order_of_path(tmp_path: Path) -> None:
    for name in ("s/kernel", "s/ust/uid/1000/64-bit", "s/archives/2/ust", "s/archives/10/ust"):
        write_trace(tmp_path / name, CONTENT)
    found = discover([tmp_path])
    assert [str(location.path.relative_to(tmp_path)) for location in found] == [
        "s/archives/10/ust",
        "s/archives/2/ust",
        "s/kernel",
        "s/ust/uid/1000/64-bit",
    ]


def test_order_does_not_depend_on_the_order_given(tmp_path: Path) -> None:
    a, b = write_trace(tmp_path / "a", CONTENT), write_trace(tmp_path / "b", CONTENT)
    assert discover([b, a]) == discover([a, b]) == discover([tmp_path])


def test_names_each_trace_once(tmp_path: Path) -> None:
    trace = write_trace(tmp_path / "session/trace", CONTENT)
    (tmp_path / "link").symlink_to(trace)
    (tmp_path / "session/loop").symlink_to(tmp_path)
    found = discover([trace, tmp_path, tmp_path / "link"])
    assert [location.path for location in found] == [trace.resolve()]


def test_size_is_that_of_the_streams(tmp_path: Path) -> None:
    trace = write_trace(tmp_path / "trace", CONTENT)
    (trace / "index").mkdir()
    (trace / "index/channel_0.idx").write_bytes(b"x" * 1000)
    (trace / ".hidden").write_bytes(b"x" * 1000)
    assert discover([trace])[0].size_bytes == (trace / "channel_0").stat().st_size


def test_empty_trace_beside_a_full_one_is_kept(tmp_path: Path) -> None:
    write_trace(tmp_path / "full", CONTENT)
    write_trace(tmp_path / "empty", TraceContent(events={}, streams={}))
    assert [location.size_bytes > 0 for location in discover([tmp_path])] == [False, True]


def test_missing_path(tmp_path: Path) -> None:
    fails([tmp_path / "nowhere"], "no such file or directory — .*/nowhere", "^ros2 trace writes")


def test_no_path() -> None:
    fails([], "no trace given", "ingest")


def test_empty_directory(tmp_path: Path) -> None:
    fails([tmp_path], "empty directory", "ros2 trace")


def test_directory_without_a_trace(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("x")
    fails([tmp_path], "no CTF trace .no file `metadata`. in this directory or below", "ros2 trace")


def test_one_of_two_paths_without_a_trace(tmp_path: Path) -> None:
    write_trace(tmp_path / "trace", CONTENT)
    (tmp_path / "other").mkdir()
    fails([tmp_path / "trace", tmp_path / "other"], "empty directory — .*/other", "ros2 trace")


@pytest.mark.parametrize(
    ("name", "what", "hint"),
    [
        ("talk_0.mcap", "a rosbag2 recording", "messages are not traces"),
        ("talk_0.db3", "a rosbag2 recording", "messages are not traces"),
        ("trace.tar.bz2", "a compressed file", "^tar xf .*trace.tar.bz2"),
        ("trace.7z", "an archive", "^tar xf .*trace.7z"),
        ("trace.tar.gz", "a compressed file", "^msgflow ingest .*trace.tar.gz"),
        ("notes.txt", "a file of another kind", "ros2 trace"),
    ],
)
def test_file_that_is_no_trace(tmp_path: Path, name: str, what: str, hint: str) -> None:
    (tmp_path / name).write_bytes(b"x")
    fails([tmp_path / name], f"not a trace but {what} — .*{name}", hint)


def test_directory_with_a_recording_of_messages(tmp_path: Path) -> None:
    (tmp_path / "talk_0.mcap").write_bytes(b"x")
    fails([tmp_path], "it holds a rosbag2 recording", "messages are not traces")


def test_file_inside_a_trace(tmp_path: Path) -> None:
    trace = write_trace(tmp_path / "trace", CONTENT)
    for name in ("metadata", "channel_0"):
        fails([trace / name], "a file inside a trace, give the directory", f"ingest {trace}$")


def test_metadata_of_another_kind(tmp_path: Path) -> None:
    (tmp_path / "metadata").write_text("name: something\n")
    fails([tmp_path], "not a CTF trace, its `metadata` is something else", "ros2 trace")


def test_empty_metadata(tmp_path: Path) -> None:
    (tmp_path / "metadata").touch()
    fails([tmp_path], "`metadata` is empty, nothing of it was written yet", "then copy it again")


@pytest.mark.parametrize("size", [20, 100, 4000])
@pytest.mark.parametrize("order", ["little", "big"])
def test_metadata_cut_off(tmp_path: Path, size: int, order: str) -> None:
    def number(value: int) -> bytes:
        return value.to_bytes(4, order)  # type: ignore[arg-type]

    header = number(0x75D11D57) + bytes(16) + bytes(4) + number(4096 * 8) + number(4096 * 8)
    whole = (header + bytes(5)).ljust(4096, b" ")
    trace = write_trace(tmp_path / "trace", CONTENT)
    (trace / "metadata").write_bytes(whole)
    assert len(discover([trace])) == 1
    (trace / "metadata").write_bytes(whole + whole[:size])
    fails([trace], "`metadata` is damaged or cut off", "copy it again")


def test_metadata_without_any_event(tmp_path: Path) -> None:
    trace = write_trace(tmp_path / "trace", TraceContent(events={"ros2:x": {}}, streams={0: []}))
    fails([tmp_path], f"has metadata but no events, nothing was recorded — {trace}", "tracetools")


@pytest.mark.parametrize("domain", ['domain = "kernel";', 'hostname = "domain";'])
def test_metadata_without_any_event_that_is_of_no_program(tmp_path: Path, domain: str) -> None:
    trace = write_trace(tmp_path / "trace", TraceContent(events={"x": {}}, streams={0: []}))
    text = (trace / "metadata").read_text()
    (trace / "metadata").write_text(text.replace('domain = "ust";', domain))
    fails([trace], f"no events, other files are missing or empty — {trace}", "copy all files")


def test_stream_that_must_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trace = write_trace(tmp_path / "trace", CONTENT)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    fails([trace], "cannot read the trace .Permission denied. — .*channel_0", "chown")


def test_metadata_that_must_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trace = write_trace(tmp_path / "trace", CONTENT)

    def refuse(path: Path, flags: int) -> int:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(os, "open", refuse)
    fails([trace], "cannot read the trace .Permission denied. — .*metadata", "chown")


def test_a_pipe_is_no_trace(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    fails([tmp_path / "pipe"], "not a trace but a pipe — .*pipe", "give the directory")


def test_directory_that_must_not_be_read(tmp_path: Path) -> None:
    if os.geteuid() == 0:
        pytest.skip("root may read every directory")
    write_trace(tmp_path / "trace", CONTENT)
    (tmp_path / "trace").chmod(0)
    try:
        fails([tmp_path], "cannot read the directory", "^ls -ld")
    finally:
        (tmp_path / "trace").chmod(0o755)


def test_metadata_that_is_renamed(tmp_path: Path) -> None:
    for name in "ab":
        write_trace(tmp_path / name, CONTENT)
    (tmp_path / "a" / "metadata").rename(tmp_path / "a" / "metadata.bak")
    (location,) = discover([tmp_path])
    assert location.strays == (tmp_path / "a" / "channel_0",)
    with msgflow.trace.open([tmp_path]) as traces:
        (damage,) = traces.damages
    assert damage.file == tmp_path / "a" / "channel_0"
    assert "`metadata`, which is missing or renamed" in damage.message
    fails([tmp_path / "a"], "a stream of a trace without its `metadata`", "^ls ")


def test_archives_below_are_those_beside_traces_that_are_not_given(tmp_path: Path) -> None:
    for name in ("a/ust", "b/ust"):
        write_trace(tmp_path / name, CONTENT)
    for name in ("a/kernel.tar.xz", "b/kernel.tgz", "b/truth.jsonl.gz"):
        (tmp_path / name).touch()
    assert archives_below([tmp_path]) == [tmp_path / "a/kernel.tar.xz", tmp_path / "b/kernel.tgz"]
    assert archives_below([tmp_path / "a", tmp_path / "a/kernel.tar.xz"]) == []
    assert archives_below([tmp_path / "a/kernel.tar.xz", tmp_path]) == [tmp_path / "b/kernel.tgz"]


def test_directories_in_a_circle(tmp_path: Path) -> None:
    write_trace(tmp_path / "a", CONTENT)
    (tmp_path / "a" / "up").symlink_to(tmp_path)
    (tmp_path / "a" / "circle").symlink_to(tmp_path / "a" / "circle")
    (location,) = discover([tmp_path])
    assert location.path == tmp_path / "a"
    fails([tmp_path / "a" / "circle"], "not a trace but a link in a circle", "give the directory")
