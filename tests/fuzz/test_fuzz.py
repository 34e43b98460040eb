"""A fixed slice of `make fuzz`: nothing that is damaged ends in anything but a clear answer."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from random import Random
from typing import Any

import pytest
from support.mutations import flip_metadata
from support.thorough import thorough

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
SEED = 1
CAMPAIGN = """
import json, sys
import fuzz
fuzz.BASES = fuzz.BASES[:int(sys.argv[3])]
found = fuzz.campaign(range(int(sys.argv[1])), int(sys.argv[2]))
print(json.dumps([[o.number, o.ending, o.bad, o.change, o.said[-500:]] for o in found]))
"""
# The same case with a fault in msgflow each time: everything is forked from here.
PLANTED = """
import json, os, signal, tempfile
from pathlib import Path
from typing import Any
import fuzz
import msgflow.cli.app, msgflow.database, msgflow.ingest.load
from msgflow import Database, TraceError

findings, query, ingest = Database.findings, Database.query, Database.ingest

def broken(self, *arguments, **options):
    raise ValueError("planted")

def killed(self, *arguments, **options):
    os.kill(os.getpid(), signal.SIGSEGV)

def endless(self, *arguments, **options):
    while True:
        pass

def damaging(self, *arguments, **options):
    with self.path.open("ab") as file:
        file.write(b"planted")
    raise TraceError("planted")

def untrue(self, name, **options):
    return query(self, "info" if name == "topics-delivery" else name, **options)

PLANTS = {
    "nothing": {},
    "traceback": {"findings": broken},
    "mistake": {"ingest": broken},
    "crash": {"findings": killed},
    "hang": {"ingest": endless},
    "damage": {"ingest": damaging},
    "unreported": {"query": untrue},
}

def harmless(directory, random):
    return "nothing"

fuzz.MUTATIONS, fuzz.STRUCTURAL = (harmless,), ()
fuzz.BASES = fuzz.BASES[:1]
found = {}
with tempfile.TemporaryDirectory() as temporary:
    bases = fuzz.prepare(Path(temporary))
    fuzz.warm_up(bases)
    for name, planted in PLANTS.items():
        # Enough for all but an endless loop, which costs as much.
        fuzz.SECONDS_OF_CPU = 2 if name == "hang" else 60
        for method in ("findings", "query", "ingest"):
            setattr(Database, method, planted.get(method, globals()[method]))
        place = Path(temporary) / name
        place.mkdir()
        found[name] = fuzz.case(1, 1, bases, ("trace",), place).bad
print(json.dumps(found))
"""

# A process that does cases ends before it has done them.
KILLED = """
import json, os, signal, sys
import fuzz

fuzz.prepare = lambda directory: []
fuzz.warm_up = lambda bases: None
fuzz.case = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
sys.argv = ["fuzz.py", "--cases", "3", "--jobs", "1"]
try:
    fuzz.main()
except SystemExit as end:
    print(json.dumps(end.code))
"""


def run(program: str, *arguments: object) -> Any:
    # In a process of its own: cases are forked from it, and what pytest has loaded would count
    # against their limits.
    ran = subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        cwd=BENCHMARKS,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr[-2000:]
    return json.loads(ran.stdout.splitlines()[-1])


@pytest.mark.thorough
def test_the_campaign_finds_what_is_planted() -> None:
    found = run(PLANTED)
    assert found == {name: [] if name == "nothing" else [name] for name in found}
    assert len(found) == 7


@pytest.mark.thorough
@pytest.mark.parametrize(("count", "recordings"), [(3, 1), thorough(26, 3)])
def test_a_slice_of_the_campaign(count: int, recordings: int) -> None:
    found = run(CAMPAIGN, count, SEED, recordings)
    assert sorted(number for number, *_ in found) == list(range(count))
    assert {ending for _, ending, *_ in found} >= {"ended", "refused"}
    assert [outcome for outcome in found if outcome[2]] == []


def test_cases_that_were_not_done_are_no_success() -> None:
    assert run(KILLED) is True


@pytest.mark.parametrize("kind", ["sparse", "device", "pipe"])
def test_a_file_that_nobody_can_read_is_not_flipped(kind: str, tmp_path: Path) -> None:
    file = tmp_path / "metadata"
    if kind == "device":
        file.symlink_to("/dev/zero")
    elif kind == "pipe":
        os.mkfifo(file)
    else:
        file.touch()
        os.truncate(file, 1 << 33)
    with pytest.raises(OSError, match="too large"):
        flip_metadata(tmp_path, Random(1))
