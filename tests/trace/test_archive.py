from __future__ import annotations

import gzip
import io
import os
import stat
import tarfile
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pyarrow as pa
import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace
from msgflow.errors import TraceError, UsageError
from msgflow.trace import TraceSet, extraction
from msgflow.trace.archive import stem
from msgflow.trace.extraction import unpack

Open = Callable[..., TraceSet]
KINDS = (".tar", ".tar.gz", ".tgz", ".tar.xz", ".txz", ".tar.zst", ".tzst", ".zip")
MODES = {".tar": "w", ".tar.gz": "w:gz", ".tgz": "w:gz", ".tar.xz": "w:xz", ".txz": "w:xz"}


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The temporary directory, in which nothing must be left."""
    path = tmp_path / "temporary"
    path.mkdir()
    monkeypatch.setenv("TMPDIR", str(path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    yield path
    assert list(path.iterdir()) == []


@pytest.fixture
def session(tmp_path: Path) -> Path:
    """Two traces of two hosts."""
    for host, time in (("robot-a", 5), ("robot-b", 3)):
        write_trace(
            tmp_path / "session" / host,
            TraceContent(
                events={"a:x": {"number": "u32"}},
                streams={0: [Packet([Event(time, "a:x", (time,))])]},
                environment={"hostname": host},
            ),
        )
    return tmp_path / "session"


def pack(directory: Path, archive: Path) -> Path:
    suffix = next(kind for kind in sorted(KINDS, key=len)[::-1] if archive.name.endswith(kind))
    if suffix == ".zip":
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
            for path in sorted(directory.rglob("*")):
                file.write(path, path.relative_to(directory.parent))
        return archive
    if suffix in MODES:
        with tarfile.open(archive, MODES[suffix]) as file:  # type: ignore[call-overload]
            file.add(directory, directory.name)
        return archive
    plain = pack(directory, archive.parent / "plain.tar")
    with pa.CompressedOutputStream(str(archive), "zstd") as stream:
        stream.write(plain.read_bytes())
    return archive


def tar_of(archive: Path, *members: tuple[str, bytes, str]) -> Path:
    """Write a tar of (name, type, name of the link's target or content)."""
    with tarfile.open(archive, "w") as file:
        for name, kind, text in members:
            member = tarfile.TarInfo(name)
            member.type = kind
            if kind == tarfile.REGTYPE:
                member.size = len(text)
            else:
                member.linkname = text
            file.addfile(member, io.BytesIO(text.encode()))
    return archive


@pytest.mark.parametrize("kind", KINDS)
def test_an_archive_is_read_like_its_content(
    open_traces: Open, session: Path, tmp_path: Path, temporary: Path, kind: str
) -> None:
    archive = pack(session, tmp_path / f"packed{kind}")
    with open_traces(session) as traces:
        expected = [(item.name, item.batch.to_pylist()) for item in traces.batches()]
    with open_traces(archive) as traces:
        assert [(item.name, item.batch.to_pylist()) for item in traces.batches()] == expected
        assert traces.event_counts == {(0, "a:x"): 1, (1, "a:x"): 1}
        hosts = [info.hostname for info in traces.traces]
        assert [info.path for info in traces.traces] == [
            archive / "session" / "robot-a",
            archive / "session" / "robot-b",
        ]
        assert hosts == ["robot-a", "robot-b"]
        assert len(list(temporary.iterdir())) == 1
    assert sorted(path.name for path in tmp_path.iterdir() if path.is_dir()) == [
        "session",
        "temporary",
    ]


def test_traces_are_in_order_of_the_paths_shown(
    open_traces: Open, session: Path, tmp_path: Path
) -> None:
    late = pack(session / "robot-a", tmp_path / "z.tar")
    early = pack(session / "robot-b", tmp_path / "a.zip")
    with open_traces(late, session / "robot-a", early) as traces:
        assert [info.path for info in traces.traces] == [
            early / "robot-b",
            session / "robot-a",
            late / "robot-a",
        ]
        list(traces.batches())
        assert traces.duplicate_packet_count == 1


def test_the_same_archive_twice_is_one(open_traces: Open, session: Path, tmp_path: Path) -> None:
    archive = pack(session, tmp_path / "packed.zip")
    (tmp_path / "link.zip").symlink_to(archive)
    with open_traces(archive, tmp_path / "link.zip") as traces:
        assert len(traces.traces) == 2


def test_a_set_that_is_not_closed_leaves_nothing(
    open_traces: Open, session: Path, tmp_path: Path, temporary: Path
) -> None:
    traces = open_traces(pack(session, tmp_path / "packed.tar"))
    assert list(temporary.iterdir())
    del traces
    assert not list(temporary.iterdir())


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
def test_an_interrupt_leaves_nothing(
    session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: type[BaseException]
) -> None:
    def interrupt(*_: object) -> None:
        raise error

    monkeypatch.setattr("msgflow.trace.extraction.Target.make_links", interrupt)
    with pytest.raises(error):
        msgflow.trace.open([pack(session, tmp_path / "packed.tar")])


def test_errors_name_the_archive(session: Path, tmp_path: Path, temporary: Path) -> None:
    (session / "robot-a" / "metadata").write_bytes(b"")
    archive = pack(session, tmp_path / "packed.tar.gz")
    with pytest.raises(TraceError, match=f"— {archive}/session/robot-a") as caught:
        msgflow.trace.open([archive])
    assert str(temporary) not in str(caught.value)


def test_an_archive_without_a_trace(tmp_path: Path) -> None:
    archive = tar_of(tmp_path / "x.tar", ("notes.txt", tarfile.REGTYPE, "hello"))
    with pytest.raises(TraceError, match=f"no CTF trace .* — {archive}"):
        msgflow.trace.open([archive])


@pytest.mark.parametrize(
    ("members", "named"),
    [
        ([("../x", tarfile.REGTYPE, "x")], "../x"),
        ([("a/../../x", tarfile.REGTYPE, "x")], "a/../../x"),
        ([("/x", tarfile.REGTYPE, "x")], "/x"),
        ([("../x", tarfile.DIRTYPE, "")], "../x"),
        ([("x", tarfile.SYMTYPE, "/etc/passwd")], "x"),
        ([("x", tarfile.SYMTYPE, "../y")], "x"),
        ([("x", tarfile.SYMTYPE, "../nothing/there")], "x"),
        ([("d", tarfile.SYMTYPE, "."), ("x", tarfile.SYMTYPE, "d/..")], "x"),
        ([("x", tarfile.LNKTYPE, "../y")], "../y"),
        ([("x", tarfile.CHRTYPE, "")], "x"),
        ([("x", tarfile.FIFOTYPE, "")], "x"),
    ],
)
def test_members_that_leave_the_archive_are_refused(
    tmp_path: Path, members: list[tuple[str, bytes, str]], named: str
) -> None:
    archive = tar_of(tmp_path / "x.tar", ("a/fine", tarfile.REGTYPE, "x"), *members)
    with pytest.raises(TraceError) as caught:
        msgflow.trace.open([archive])
    assert f"{named!r} — {archive}" in caught.value.message
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("name", ["../x", "/x"])
def test_members_of_a_zip_are_refused_too(tmp_path: Path, name: str) -> None:
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as file:
        file.writestr(name, "x")
    with pytest.raises(TraceError, match="a member of the archive would lie outside of it"):
        msgflow.trace.open([tmp_path / "x.zip"])


@pytest.mark.parametrize(("kind", "why"), [(stat.S_IFLNK, "leads outside"), (stat.S_IFIFO, "devi")])
def test_special_members_of_a_zip(tmp_path: Path, kind: int, why: str) -> None:
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as file:
        member = zipfile.ZipInfo("a/link")
        member.external_attr = (kind | 0o644) << 16
        file.writestr(member, "../../x")
    with pytest.raises(TraceError, match=why) as caught:
        msgflow.trace.open([tmp_path / "x.zip"])
    assert "'a/link'" in caught.value.message


def test_nothing_is_written_through_a_link(tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    for members in (
        [("d", tarfile.SYMTYPE, str(outside)), ("d/x", tarfile.REGTYPE, "x")],
        [("d", tarfile.SYMTYPE, str(outside)), ("d/x", tarfile.SYMTYPE, "y")],
    ):
        with pytest.raises(TraceError):
            msgflow.trace.open([tar_of(tmp_path / "x.tar", *members)])
        assert not list(outside.iterdir())


def test_links_inside_are_kept(tmp_path: Path) -> None:
    archive = tar_of(
        tmp_path / "x.tar",
        ("link", tarfile.SYMTYPE, "a/file"),
        ("a/file", tarfile.REGTYPE, "x"),
        ("a/again", tarfile.LNKTYPE, "a/file"),
        ("a/nowhere", tarfile.SYMTYPE, "missing"),
    )
    target = tmp_path / "target"
    target.mkdir()
    unpack(archive, target)
    assert (target / "link").read_text() == (target / "a" / "again").read_text() == "x"
    assert sorted(os.listdir(target / "a")) == ["again", "file"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("part", [0.3, 0.9])
def test_an_archive_that_is_cut_off(session: Path, tmp_path: Path, kind: str, part: float) -> None:
    archive = pack(session, tmp_path / f"packed{kind}")
    content = archive.read_bytes()
    if kind == ".tar":
        # The end is padding: only what lies before it can be missed.
        content = content.rstrip(b"\0")
    archive.write_bytes(content[: int(len(content) * part)])
    with pytest.raises(TraceError, match=f"damaged or cut off .* — {archive}") as caught:
        msgflow.trace.open([archive])
    assert "copy or pack it again" in str(caught.value.hint)


def test_an_archive_cut_off_between_members(session: Path, tmp_path: Path) -> None:
    archive = pack(session, tmp_path / "packed.tar")
    with tarfile.open(archive) as file:
        last = file.getmembers()[-1]
    archive.write_bytes(archive.read_bytes()[: last.offset])
    with pytest.raises(TraceError, match="damaged or cut off"):
        msgflow.trace.open([archive])


@pytest.mark.parametrize("kind", [".tar", ".tar.gz", ".zip"])
def test_what_is_no_archive_at_all(tmp_path: Path, kind: str) -> None:
    for content in (b"", b"hello" * 500, b"PK\3\4", b"\x1f\x8b\x08"):
        (tmp_path / f"x{kind}").write_bytes(content)
        with pytest.raises(TraceError, match="the archive is damaged or cut off"):
            msgflow.trace.open([tmp_path / f"x{kind}"])


@pytest.mark.parametrize("kind", [".tar.gz", ".tar.zst", ".zip"])
def test_a_bomb_does_not_fill_the_disk(
    session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    (session / "zeros").write_bytes(bytes(3_000_000))
    archive = pack(session, tmp_path / f"bomb{kind}")
    assert archive.stat().st_size < 20_000
    usage = type("Usage", (), {"free": 2_000_000})
    monkeypatch.setattr("shutil.disk_usage", lambda _: usage)
    with pytest.raises(TraceError, match=f"not enough free disk space .* — {archive}") as caught:
        msgflow.trace.open([archive])
    assert "TMPDIR=" in str(caught.value.hint)


@pytest.mark.parametrize("kind", [".tar", ".tar.gz", ".tar.zst"])
def test_what_follows_the_archive_is_counted(
    session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    content = pack(session, tmp_path / "a.tar").read_bytes()
    archive = tmp_path / f"b{kind}"
    packed = content + bytes(3 << 20)
    if kind == ".tar.gz":
        packed = gzip.compress(packed)
    elif kind == ".tar.zst":
        packed = pa.Codec("zstd").compress(packed, asbytes=True)
    archive.write_bytes(packed)
    monkeypatch.setattr(extraction, "MOST_UNPACKED", 2 << 20)
    monkeypatch.setattr(extraction, "_MOST_RATIO", 0)
    with pytest.raises(TraceError, match="bytes unpacked"):
        msgflow.trace.open([archive])


def test_many_small_files_need_room_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    members = [(f"{number}", tarfile.REGTYPE, "") for number in range(600)]
    usage = type("Usage", (), {"free": 2_000_000})
    monkeypatch.setattr("shutil.disk_usage", lambda _: usage)
    with pytest.raises(TraceError, match="not enough free disk space"):
        msgflow.trace.open([tar_of(tmp_path / "bomb.tar", *members)])


def test_a_header_of_absurd_size_is_not_read(tmp_path: Path) -> None:
    member = tarfile.TarInfo("././@LongLink")
    member.type, member.size = tarfile.GNUTYPE_LONGNAME, 1 << 32
    (tmp_path / "x.tar").write_bytes(member.tobuf() + bytes(1024))
    with pytest.raises(TraceError, match="a header of absurd size"):
        msgflow.trace.open([tmp_path / "x.tar"])


def test_names_without_suffix(tmp_path: Path) -> None:
    for name in ("run.1.tar.gz", "run.1.TGZ", "run.1.zip", "run.1.tar"):
        (tmp_path / name).touch()
        assert stem(tmp_path / name) == "run.1"
    assert stem(tmp_path / "missing.zip") == "missing.zip"
    (tmp_path / "directory.tar").mkdir()
    assert stem(tmp_path / "directory.tar") == "directory.tar"


class TestBounds:
    """What is packed small may be large."""

    def bomb(self, archive: Path, size: int) -> Path:
        """A directory of a sparse file: a tar with holes, which is a few kilobytes."""
        with tarfile.open(archive, "w:gz", compresslevel=1) as tar:
            member = tarfile.TarInfo("trace/stream")
            member.size = size
            tar.addfile(member, _Zeros(size))
        return archive

    def test_ratio(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(extraction, "MOST_UNPACKED", 1 << 20)
        archive = self.bomb(tmp_path / "bomb.tar.gz", 2 << 20)
        with pytest.raises(TraceError, match=r"than 1,048,576 bytes unpacked, .* packed") as caught:
            msgflow.trace.open([archive])
        assert "MSGFLOW_UNPACK_LIMIT=" in (caught.value.hint or "")

    def test_a_member_is_refused_before_it_is_written(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """As a sparse one of terabytes has to be."""
        archive = tmp_path / "sparse.tar"
        member = tarfile.TarInfo("trace/stream")
        member.size = 1 << 40
        archive.write_bytes(member.tobuf() + bytes(10_240))

        def write(*_: object) -> None:
            raise AssertionError("it is written")

        monkeypatch.setattr("msgflow.trace.extraction.Target.write", write)
        with pytest.raises(TraceError, match="bytes unpacked"):
            msgflow.trace.open([archive])

    def test_the_limit_can_be_raised(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(extraction, "MOST_UNPACKED", 1 << 20)
        archive = self.bomb(tmp_path / "bomb.tar.gz", 2 << 20)
        monkeypatch.setenv("MSGFLOW_UNPACK_LIMIT", "3 MB")
        with pytest.raises(TraceError, match="no CTF trace"):
            msgflow.trace.open([archive])
        monkeypatch.setenv("MSGFLOW_UNPACK_LIMIT", "2MB")
        with pytest.raises(TraceError, match="more than 2,000,000 bytes"):
            msgflow.trace.open([archive])
        monkeypatch.setenv("MSGFLOW_UNPACK_LIMIT", "much")
        with pytest.raises(UsageError, match="not an amount of bytes: much"):
            msgflow.trace.open([archive])

    def test_a_usual_ratio_is_no_bomb(
        self, session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(extraction, "MOST_UNPACKED", 0)
        with msgflow.trace.open([pack(session, tmp_path / "session.tar.gz")]) as traces:
            assert traces.traces


class _Zeros:
    def __init__(self, size: int) -> None:
        self._left = size

    def read(self, size: int) -> bytes:
        size = min(size, self._left)
        self._left -= size
        return bytes(size)


@pytest.mark.parametrize("first", ["file", "directory"])
def test_one_name_of_two_kinds(tmp_path: Path, first: str) -> None:
    archive = tmp_path / "odd.tar"
    with tarfile.open(archive, "w") as tar:
        directory = tarfile.TarInfo("trace/name")
        directory.type = tarfile.DIRTYPE
        members = [tarfile.TarInfo("trace/name"), directory]
        for member in members if first == "file" else members[::-1]:
            tar.addfile(member)
    with pytest.raises(TraceError, match="is both a directory and something else") as caught:
        msgflow.trace.open([archive])
    assert "copy or pack it again" in (caught.value.hint or "")


def test_an_archive_that_is_a_link_in_a_circle(tmp_path: Path) -> None:
    (tmp_path / "a.tar").symlink_to(tmp_path / "a.tar")
    with pytest.raises(TraceError, match="not a trace but a link in a circle"):
        msgflow.trace.open([tmp_path / "a.tar"])
