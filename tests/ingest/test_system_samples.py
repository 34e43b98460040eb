"""Samples of the system beside a trace: which files are read, and what is said of others."""

from __future__ import annotations

import gzip
import random
import shutil
import zlib
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.thorough import examples

from msgflow import trace as trace_package
from msgflow.errors import TraceError
from msgflow.ingest import IngestReport, ingest
from msgflow.trace import system_samples
from msgflow.trace.discovery import SYSTEM_SAMPLES as FILE
from msgflow.trace.system_samples import read_system_samples

HEAD = b"msgflow usage 1\thost\tboot\n"


@pytest.fixture
def session(trace: Path, tmp_path: Path) -> Path:
    """A copy of a trace."""
    return Path(shutil.copytree(trace, tmp_path / "session"))


@pytest.fixture
def text(session: Path, database: Path) -> bytes:
    return text_of(session, database)


def text_of(session: Path, database: Path) -> bytes:
    """Return samples of the threads of a trace: each ran for 5 ms, and waited for as long."""
    with trace_package.open([session]) as opened:
        trace = opened.traces[0]
    with duckdb.connect(str(database), read_only=True) as con:
        threads = con.execute(
            "SELECT p.pid, t.tid FROM thread AS t JOIN process AS p USING (process_id) "
            "JOIN host AS h USING (host_id) WHERE h.hostname = ? ORDER BY ALL",
            [trace.hostname],
        ).fetchall()
        ((first,),) = con.execute("SELECT min(first_seen_ns) FROM thread").fetchall()
    begin = first - trace.clock_offset_ns
    boot = trace.clock_uuid or ""
    lines = [f"msgflow usage 1\t{trace.hostname}\t{boot}\t100\t2\t1 2"]
    lines += [f"look\t{begin}\tall"]
    for number, (pid, tid) in enumerate(threads):
        lines.append(f"thread\t{number}\t{1000 + pid}\t{pid}\t{tid}")
        lines.append(f"run\t{number}\t0\tS\t5\t7\t0\t0\t0\t0\t0")
    lines.append(f"look\t{begin + 10**8}\tthreads")
    lines += [f"run\t{n}\t0\tS\t5000005\t5000007\t0\t0\t0\t0\t0" for n in range(len(threads))]
    return "".join(f"{line}\n" for line in lines).encode()


def usage(database: Path, what: str = "count(*), count(DISTINCT thread_id)") -> tuple[Any, ...]:
    with duckdb.connect(str(database), read_only=True) as con:
        row = con.execute(f"SELECT {what} FROM thread_usage WHERE running_ns = 5000000").fetchone()
    assert row is not None
    return row


def said(report: IngestReport) -> list[str]:
    return [one.detail for one in report.findings if one.name == "usage_left_out"]


def test_samples_beside_a_trace_are_read(session: Path, text: bytes, new_database: Path) -> None:
    (session / FILE).write_bytes(gzip.compress(text, mtime=0))
    report = ingest([session], new_database)
    assert said(report) == []
    count = text.count(b"thread\t")
    assert count
    assert usage(new_database) == (count, count)


def test_samples_in_an_archive_are_read(session: Path, text: bytes, new_database: Path) -> None:
    (session / FILE).write_bytes(gzip.compress(text, mtime=0))
    archive = shutil.make_archive(str(session), "tar", session)
    ingest([archive], new_database)
    count = text.count(b"thread\t")
    assert usage(new_database) == (count, count)


@pytest.mark.thorough
def test_each_host_has_its_samples(other_trace: Path, new_database: Path, tmp_path: Path) -> None:
    """The recording has two machines, and one gets another name."""
    pair = Path(shutil.copytree(other_trace, tmp_path / "pair"))
    ingest([pair], tmp_path / "before.duckdb")
    count = 0
    for host in (pair / "alpha", pair / "beta"):
        text = text_of(host, tmp_path / "before.duckdb")
        (host / FILE).write_bytes(gzip.compress(text, mtime=0))
        count += text.count(b"thread\t")
    report = ingest([pair], new_database, hosts={"robot": pair / "alpha"})
    assert said(report) == []
    assert usage(new_database) == (count, count)


def test_samples_alone_are_no_recording(tmp_path: Path, new_database: Path) -> None:
    (tmp_path / FILE).write_bytes(gzip.compress(HEAD, mtime=0))
    with pytest.raises(TraceError, match="no CTF trace \\(no file `metadata`\\) in this directory"):
        ingest([tmp_path], new_database)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "it ends early"),
        (gzip.compress(b"", mtime=0)[:5], "it ends early"),
        (b"not packed at all", "it is damaged behind its first 0 lines"),
        (gzip.compress(b"a table\nof somebody else\n", mtime=0), "it has no samples of the system"),
        (gzip.compress(b"msgflow usage 2\tx\n", mtime=0), "or those of a later msgflow"),
    ],
)
def test_what_cannot_be_read_is_a_finding_and_the_run_is_stored(
    session: Path, new_database: Path, content: bytes, reason: str
) -> None:
    (session / FILE).write_bytes(content)
    report = ingest([session], new_database)
    (finding,) = [one for one in report.findings if one.name == "usage_left_out"]
    assert finding.subject == str(session / FILE)
    assert reason in finding.detail
    assert usage(new_database) == (0, 0)


def test_of_a_file_that_is_cut_off_what_is_there_is_used(
    session: Path, text: bytes, new_database: Path
) -> None:
    pack = zlib.compressobj(wbits=31)
    (session / FILE).write_bytes(pack.compress(text) + pack.flush(zlib.Z_SYNC_FLUSH))
    assert said(ingest([session], new_database)) == [
        "it ends early: its recording was killed, or it is not over"
    ]
    count = text.count(b"thread\t")
    assert usage(new_database) == (count, count)


def test_samples_of_another_boot_are_left_out(
    session: Path, text: bytes, new_database: Path
) -> None:
    head, rest = text.split(b"\n", 1)
    fields = head.split(b"\t")
    fields[2] = b"11111111-1111-1111-1111-111111111111"
    (session / FILE).write_bytes(gzip.compress(b"\t".join(fields) + b"\n" + rest))
    (reason,) = said(ingest([session], new_database))
    assert "are of another machine or boot than the traces" in reason


def test_files_have_bounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On lines, and on the length of each: a small file may unpack to any size."""
    long = b"a" * 5000
    (tmp_path / FILE).write_bytes(
        gzip.compress(HEAD + long * 1000 + b"\nb\n" + long + b"\nc\0d\n", mtime=0)
    )
    damages: list[str] = []
    assert list(read_system_samples(tmp_path / FILE, damages)) == [
        [HEAD.decode().strip()],
        ["b", "cd"],
    ]
    assert damages == ["2 of its lines are too long, and left out"]
    monkeypatch.setattr(system_samples, "_MOST_LINES", 3)
    monkeypatch.setattr(system_samples, "_MOST_AT_ONCE", 30)
    (tmp_path / FILE).write_bytes(gzip.compress(HEAD + b"\n" * 1000, mtime=0))
    damages.clear()
    assert sum(map(len, read_system_samples(tmp_path / FILE, damages))) <= 3
    assert damages == ["only the first 3 of its lines are used"]


def test_a_file_that_is_none_is_not_opened(tmp_path: Path) -> None:
    (tmp_path / FILE).symlink_to("/dev/zero")
    damages: list[str] = []
    assert list(read_system_samples(tmp_path / FILE, damages)) == []
    assert damages == ["it cannot be read: a device, no file"]


@pytest.mark.thorough
def test_damaged_files_end_no_ingest(session: Path, text: bytes, new_database: Path) -> None:
    """Bytes that change in the text or in what is packed, and ends that are missing."""
    chance = random.Random(1)
    for number in range(examples(5, 60)):
        plain = bytearray(text)
        for _ in range(chance.randrange(1, 60)):
            plain[chance.randrange(len(plain))] = chance.choice(b"0123456789\t\n -x\xff\0")
        packed = bytearray(gzip.compress(plain, mtime=0))
        if number % 2:
            packed[chance.randrange(len(packed))] = chance.randrange(256)
            del packed[chance.randrange(len(packed)) :]
        (session / FILE).write_bytes(packed)
        ingest([session], new_database, name="damaged", replace=bool(number))
        with duckdb.connect(str(new_database)) as con:
            assert con.execute(
                "SELECT count(*) FROM store.thread_usage AS u ANTI JOIN store.thread "
                "USING (thread_id)"
            ).fetchone() == (0,)
