"""Samples of perf beside a trace: which files are read, and what is said of those that are not."""

from __future__ import annotations

import itertools
import os
import random
import shutil
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.thorough import examples

from msgflow import open_db
from msgflow import trace as trace_package
from msgflow.errors import TraceError
from msgflow.ingest import IngestReport, ingest
from msgflow.trace import perf_script
from msgflow.trace.perf_script import DATA, TEXT, read_script, write_script

STACK = "\t    11a8 hog (/lib/libhog.so)\n\t     279 main (/bin/robot)\n"
HEADER = "# hostname : {}\n# clockid: monotonic (1)\n"


@pytest.fixture
def session(trace: Path, tmp_path: Path) -> Path:
    """A copy of a trace."""
    return Path(shutil.copytree(trace, tmp_path / "session"))


@pytest.fixture
def text(session: Path, database: Path) -> str:
    return text_of(session, database)


def calls(
    session: Path, database: Path, columns: str, joined: str = ""
) -> tuple[int, str, list[Any]]:
    """Return the offset of the trace's clock, its host, and of each callback pid, tid and more."""
    with trace_package.open([session]) as opened:
        offset, hostname = opened.traces[0].clock_offset_ns, opened.traces[0].hostname
    with duckdb.connect(str(database), read_only=True) as con:
        rows = con.execute(
            f"SELECT p.pid, t.tid, {columns} FROM callback_instance AS i "
            "JOIN thread AS t USING (thread_id) JOIN process AS p ON i.process_id = p.process_id "
            f"JOIN host AS h USING (host_id) {joined} WHERE h.hostname = ?",
            [hostname],
        )
        return offset, hostname, rows.fetchall()


def text_of(session: Path, database: Path) -> str:
    """Return what `perf script` says of it: a sample in the middle of each callback."""
    offset, hostname, rows = calls(session, database, "(i.start_ns + i.end_ns) // 2")
    moments = [(pid, tid, *divmod(ns - offset, 10**9)) for pid, tid, ns in rows]
    heads = [
        f"  {pid}/{tid}  [000] {second}.{rest:09}:  7 cpu-clock: \n"
        for pid, tid, second, rest in moments
    ]
    return HEADER.format(hostname) + "".join(f"\n{head}{STACK}" for head in heads)


def inside(report: IngestReport, database: Path) -> tuple[int, int]:
    """Return how many samples there are, and of how many callback instances."""
    assert not report.warnings
    with duckdb.connect(str(database), read_only=True) as con:
        row = con.execute(
            "SELECT count(*), count(DISTINCT callback_instance_id) FROM stack_sample"
        ).fetchone()
    assert row is not None
    return row


@pytest.mark.thorough
def test_the_text_of_perf_beside_a_trace_is_read(
    session: Path, text: str, new_database: Path
) -> None:
    (session / TEXT).write_text(text)
    (session / DATA).write_text("of a folder with a text, nothing else is read")
    count = text.count("cpu-clock")
    assert count
    assert inside(ingest([session], new_database), new_database) == (count, count)


def test_shares_of_functions_of_a_simulated_system(
    session: Path, database: Path, new_database: Path
) -> None:
    """Ten samples of each call: one in a function, three in another, six in a third."""
    offset, hostname, rows = calls(
        session,
        database,
        "i.start_ns + (i.end_ns - i.start_ns) * (2 * k + 1) // 20, k, l.node || ' ' || l.label",
        "JOIN callback_label AS l USING (callback_id) CROSS JOIN range(10) AS r (k)",
    )
    text = HEADER.format(hostname)
    for pid, tid, ns, part, callback in rows:
        second, rest = divmod(ns - offset, 10**9)
        hog = 10 if part == 0 else 30 if part < 4 else 60
        text += f"\n {pid}/{tid}  [000] {second}.{rest:09}:  7 cpu-clock: \n"
        text += f"\t 11a8 hog_{hog} of {callback} (/lib/libhog.so)\n\t 279 main (/bin/robot)\n"
    (session / TEXT).write_text(text)
    ingest([session], new_database)
    with open_db(new_database) as opened_database:
        found = opened_database.query("functions", internal=True).to_arrow().to_pylist()
    shares = {
        (row["node"], row["callback"], row["function"]): row["self_share"]
        for row in found
        if row["function"] != "main"
    }
    callbacks = {(node, callback) for node, callback, _ in shares}
    assert len(callbacks) > 3
    assert shares == {
        (node, callback, f"hog_{share} of {node} {callback}"): share / 100
        for node, callback in callbacks
        for share in (10, 30, 60)
    }
    assert len(rows) == sum(row["samples"] for row in found if row["function"] == "main")


# Without -F: of the thread alone, or of neither time nor CPU; of one address; of another event.
PLAIN = (
    f"node  4711 [000] 1000.000001:    1001001 cpu-clock: \n{STACK}\n"
    f"my node 4711 cycles:u: \n{STACK}\n"
    "node  4711 1000.000001: cpu-clock:  55d0c0de1000 compute (/opt/node)\n"
    "node  4711 [001] 1000.000001:          1 page-faults:  55d0c0de1000 compute (/opt/node)\n"
)


def test_the_text_of_plain_perf_script_is_not_joined(session: Path, new_database: Path) -> None:
    """A line of a name is none of these samples."""
    name = f"a\nname 1/1 [000] 1.000001: 7 cache-misses: \n{STACK}\n"
    (session / TEXT).write_text(HEADER.format("anywhere") + PLAIN + name)
    findings = ingest([session], new_database).findings
    by_count = {one.count: one.detail for one in findings if one.name == "samples_not_joined"}
    assert by_count.keys() == {1, 4}
    assert "none of 1 samples of functions is of a clock" in by_count[1]
    assert "4 samples or lines lack the id of their process" in by_count[4]
    assert "perf script --header --ns -F pid,tid,cpu,time," in by_count[4]


def test_samples_in_an_archive_are_read(session: Path, text: str, new_database: Path) -> None:
    (session / TEXT).write_text(text)
    archive = shutil.make_archive(str(session), "tar", session)
    count = text.count("cpu-clock")
    assert inside(ingest([archive], new_database), new_database) == (count, count)


def test_what_cannot_be_read_in_an_archive_is_named_there(
    session: Path, new_database: Path
) -> None:
    (session / DATA).write_bytes(b"no such thing")
    archive = shutil.make_archive(str(session), "tar", session)
    (warning,) = ingest([archive], new_database).warnings
    assert warning.endswith(f"— {archive}/{DATA}")


@pytest.mark.thorough
def test_samples_are_of_the_host_that_the_traces_beside_them_are_given(
    other_trace: Path, new_database: Path, tmp_path: Path
) -> None:
    """Of two hosts, each with a clock of its own."""
    pair = Path(shutil.copytree(other_trace, tmp_path / "pair"))
    ingest([pair], tmp_path / "before.duckdb")
    text = text_of(pair / "alpha", tmp_path / "before.duckdb")
    (pair / "alpha" / TEXT).write_text(text.replace("# hostname : ", "# hostname : outside-"))
    report = ingest([pair], new_database, hosts={"robot": pair / "alpha"})
    count = text.count("cpu-clock")
    assert inside(report, new_database) == (count, count)


def test_what_perf_recorded_is_read_by_perf(session: Path, new_database: Path) -> None:
    if shutil.which("perf") is None:
        pytest.skip("no perf")
    command = ["perf", "record", "-q", "-e", "cpu-clock", "-g", "-o", str(session / DATA)]
    if subprocess.run([*command, "--", "true"], stderr=subprocess.DEVNULL).returncode:
        pytest.skip("perf may not")
    report = ingest([session], new_database)
    assert not report.warnings
    # This process was not traced, and perf's own clock is another one.
    (finding,) = [one for one in report.findings if one.name == "samples_not_joined"]
    assert "have times of another clock" in finding.detail


def test_what_cannot_be_read_is_said_and_the_run_is_stored(
    session: Path, new_database: Path
) -> None:
    (session / DATA).write_bytes(b"no such thing")
    report = ingest([session], new_database)
    (warning,) = report.warnings
    assert warning == (
        f"the samples of functions are not read: this is no recording of perf — {session / DATA}"
    )
    assert new_database.exists()


def test_a_damaged_recording_of_perf_is_not_read(tmp_path: Path) -> None:
    (tmp_path / DATA).write_bytes(b"PERFILE2" + bytes(100))
    with pytest.raises(TraceError, match="are not read"):
        write_script(tmp_path / DATA, tmp_path / TEXT)


def test_without_perf_its_recording_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / DATA).write_bytes(b"PERFILE2")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(TraceError, match="perf is not installed") as raised:
        write_script(tmp_path / DATA, tmp_path / TEXT)
    assert raised.value.hint == "apt-get install linux-perf"


def test_perf_has_bounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On memory, and on what it writes: of that, the begin is used."""
    (tmp_path / DATA).write_bytes(b"PERFILE2")
    perf = tmp_path / "perf"
    perf.write_text("#!/bin/sh\nexec python3 -c 'bytearray(5 << 30)'\n")
    perf.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    with pytest.raises(TraceError, match="MemoryError"):
        write_script(tmp_path / DATA, tmp_path / TEXT)
    perf.write_text("#!/bin/sh\nexec yes '1/1 1.000000: cpu-clock:'\n")
    monkeypatch.setattr(perf_script, "_MOST_BYTES", 1000)
    said = write_script(tmp_path / DATA, tmp_path / TEXT)
    assert said == f"samples after the first 1,000 bytes of text are left out — {tmp_path / DATA}"
    (samples,) = read_script(tmp_path / TEXT)
    assert len(samples.heads) == 40


HOSTILE = [
    "\t 1 a;b'\"\\ <script>alert(1)</script> ((([[ (/lib/x)\n",
    "\t 1 " + "x" * 100_000 + " (/lib/x)\n",
    "\t 1 \udcff\x00\x1b[31m (/lib/../../etc/passwd)\n",
    "\t 1 py:::: (/tmp/perf-1.map)\n",
    "\t 1 new\nline 1/1 [000] 1.000000000: 7 cpu-clock: \n (/lib/x)\n",
    "\t" * 5_000 + "\n",
    "\t 1 py::half\udcc3;\u2028\u202e</script>\x1b]0;title\x07:/tmp/r.py (/tmp/perf-1.map)\n",
    "\t 1 " + "x" * 1_000_000 + " (/lib/x)\n",
]


@pytest.fixture
def hostile(session: Path, text: str, new_database: Path) -> Path:
    """A database of samples in whose stacks is each name of an attacker."""
    count = text.count("cpu-clock")
    assert count > len(HOSTILE)
    head, *others = text.split(STACK)
    parts = [f"{line}{STACK}{other}" for line, other in zip(itertools.cycle(HOSTILE), others)]
    (session / TEXT).write_bytes("".join([head, *parts]).encode(errors="surrogateescape"))
    assert inside(ingest([session], new_database), new_database) == (count, count)
    return new_database


def test_names_of_an_attacker_do_no_harm(hostile: Path, tmp_path: Path) -> None:
    """No control of a name but the ends of lines."""
    with open_db(hostile) as opened:
        opened.export_folded(tmp_path / "folded")
    assert set((tmp_path / "folded").read_bytes()).isdisjoint({*range(10), *range(11, 32), 127})


@pytest.mark.thorough
def test_names_of_an_attacker_do_no_harm_in_a_report(hostile: Path, tmp_path: Path) -> None:
    """No end of a script that a name wrote."""
    with open_db(hostile) as opened:
        opened.report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "<script>alert(1)" not in page
    assert "</script>\x1b" not in page


def test_a_deep_stack_is_cut(tmp_path: Path) -> None:
    (tmp_path / TEXT).write_text("1/1 1.000000: cpu-clock:\n" + "\t1 f (/a)\n" * 5_000)
    (samples,) = read_script(tmp_path / TEXT)
    assert samples.stacks[0].count("\n") < 2_000


@pytest.mark.thorough
def test_damaged_files_end_no_ingest(session: Path, text: str, new_database: Path) -> None:
    """Bytes that change, and ends that are missing: the callbacks are those of the trace always."""
    chance = random.Random(1)
    whole = text.encode()
    for number in range(examples(10, 300)):
        damaged = bytearray(whole)
        for _ in range(chance.randrange(1, 60)):
            damaged[chance.randrange(len(damaged))] = chance.randrange(256)
        (session / TEXT).write_bytes(damaged[: chance.randrange(len(damaged))])
        ingest([session], new_database, name="damaged", replace=bool(number))
        with duckdb.connect(str(new_database)) as con:
            assert con.execute(
                "SELECT count(*) FROM stack_sample AS s ANTI JOIN stack USING (stack_id)"
            ).fetchone() == (0,)


@pytest.mark.thorough
def test_damaged_recordings_of_perf_end_no_ingest(session: Path, tmp_path: Path) -> None:
    """perf itself may crash: the text that it wrote until then is not used."""
    if shutil.which("perf") is None:
        pytest.skip("no perf")
    data = tmp_path / DATA
    command = ["perf", "record", "-q", "-e", "cpu-clock", "-g", "-k", "CLOCK_MONOTONIC"]
    subprocess.run([*command, "-o", str(data), "--", "python3", "-c", "sum(range(10**7))"])
    if not data.exists():
        pytest.skip("perf may not")
    chance = random.Random(2)
    whole = data.read_bytes()
    begun = time.monotonic()
    for _ in range(examples(10, 300)):
        damaged = bytearray(whole)
        for _ in range(chance.randrange(1, 20)):
            damaged[chance.randrange(8, len(damaged))] = chance.randrange(256)
        data.write_bytes(damaged[: chance.randrange(8, len(damaged))])
        with suppress(TraceError):
            write_script(data, tmp_path / TEXT)
        list(read_script(tmp_path / TEXT))
    assert time.monotonic() - begun < 600
