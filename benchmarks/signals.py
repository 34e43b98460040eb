"""Ends commands that write at random moments, and looks at what is left.

    python benchmarks/signals.py [--moments 200] [--seed 1] [--command NAME]…

SIGINT, SIGTERM and SIGKILL meet `ingest` (into a new and into an old database), `links apply`,
`clocks apply`, `db upgrade` and `export` in turn, each at a moment between its start and a little
behind its usual end. Afterwards the database has to be the old or the new one (by the rows of its
runs), `db check` clean, and after one more command nothing else may lie in its directory. Exit code
1 otherwise.
"""

from __future__ import annotations

import argparse
import collections
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import duckdb

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

MSGFLOW = [sys.executable, "-m", "msgflow"]
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
# After SIGKILL the command has no code of its own.
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -9}
NAMES = ("ingest, new", "ingest, old", "links apply", "clocks apply", "db upgrade", "export")
STATE = """
SELECT r.run_id, r.name, r.derivation_hash,
    (SELECT count(*) FROM store.annotation AS a WHERE a.run_id = r.run_id),
    (SELECT string_agg(c.method, ',' ORDER BY c.clock_id) FROM store.clock AS c
        WHERE c.run_id = r.run_id),
    (SELECT count(*) FROM store.link_transport AS l WHERE l.run_id = r.run_id)
FROM store.run AS r
ORDER BY r.run_id
"""


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command line to its end."""
    command = [*MSGFLOW, *(str(argument) for argument in arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def state(database: Path) -> object:
    """Return what distinguishes the old database from the new one."""
    if not database.exists():
        return None
    with duckdb.connect(str(database), read_only=True) as con:
        views = con.execute("SELECT count(*) FROM duckdb_views() WHERE NOT internal").fetchall()
        return con.execute(STATE).fetchall(), views


class Place:
    """A directory with a database, in which one command is run over and over."""

    def __init__(self, root: Path) -> None:
        self.trace, self.other = root / "robot", root / "pair"
        self.old, self.stale = root / "old.duckdb", root / "stale.duckdb"
        self.links = root / "links.yaml"
        for system, path in (("pipeline", self.trace), ("two_hosts", self.other)):
            assert run("simulate", system, path, "--factor", "0.02").returncode == 0
        assert run("ingest", self.other, "--db", self.old).returncode == 0
        shutil.copyfile(self.old, self.stale)
        with duckdb.connect(str(self.stale)) as con:
            con.execute("UPDATE store.definition SET hash = 'old'")
            con.execute("UPDATE store.run SET derivation_hash = 'old'")
        self.links.write_text("links: []\n", encoding="utf-8")
        self.directory = root / "place"
        self.database = self.directory / "msgflow.duckdb"

    def commands(self) -> dict[str, tuple[Path | None, list[object]]]:
        """Return by name: the database before, and the command line."""
        there = ["--db", self.database]
        return {
            "ingest, new": (None, ["ingest", self.trace, *there]),
            "ingest, old": (self.old, ["ingest", self.trace, *there]),
            "links apply": (self.old, ["links", "apply", self.links, *there]),
            "clocks apply": (self.old, ["clocks", "apply", "messages", *there]),
            "db upgrade": (self.stale, ["db", "upgrade", *there]),
            "export": (self.old, ["export", "parquet", self.directory / "out", "--force", *there]),
        }

    def prepare(self, before: Path | None) -> None:
        """Make the directory anew."""
        shutil.rmtree(self.directory, ignore_errors=True)
        self.directory.mkdir()
        if before is not None:
            shutil.copyfile(before, self.database)

    def faults(self, number: int, code: int, states: list[object]) -> list[str]:
        """Return what is wrong after a command that got a signal, and one more that did not."""
        found = []
        if code not in (0, CODES[signal.Signals(number)], -number):
            found.append(f"exit code {code}")
        if state(self.database) not in states:
            found.append("neither the old nor the new database")
        there = ["--db", self.database]
        if self.database.exists():
            for command in ("upgrade", "check"):
                done = run("db", command, *there)
                if done.returncode:
                    found.append(f"db {command}: {done.returncode} {done.stdout}{done.stderr}")
        else:
            run("ingest", self.trace, *there)
        if (self.directory / "out").exists():
            again = run("export", "parquet", self.directory / "out", "--force", *there)
            if again.returncode:
                found.append(f"export again: {again.stderr}")
            found += [path.name for path in (self.directory / "out").glob(".*")]
        left = set(os.listdir(self.directory)) - {self.database.name, "out"}
        return found + sorted(left)

    def known(self, name: str) -> tuple[list[object], float]:
        """Run a command without a signal; return the states before and after, and the seconds."""
        before, command = self.commands()[name]
        self.prepare(before)
        states, began = [state(self.database)], time.monotonic()
        done = run(*command)
        assert done.returncode == 0, done.stderr
        return [*states, state(self.database)], time.monotonic() - began

    def stopped(
        self, name: str, number: signal.Signals, after: float, states: list[object]
    ) -> tuple[int, list[str]]:
        """Run a command and send it a signal; return its exit code, and what is wrong then."""
        before, command = self.commands()[name]
        self.prepare(before)
        line = [*MSGFLOW, *(str(argument) for argument in command)]
        process = subprocess.Popen(
            line, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        time.sleep(after)
        process.send_signal(number)
        _, errors = process.communicate(timeout=600)
        found = self.faults(number, process.returncode, states)
        # Until its first import of ours, Python answers for itself.
        if "unexpected" in errors or ("Traceback" in errors and "msgflow" in errors):
            found.append(errors)
        return process.returncode, found


def moments(
    count: int, seed: int, names: Sequence[str] = NAMES, signals: Sequence[signal.Signals] = SIGNALS
) -> Iterator[tuple[str, signal.Signals, int, list[str]]]:
    """Yield command, signal, exit code and faults of so many random moments."""
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as directory:
        place = Place(Path(directory))
        known = {name: place.known(name) for name in names}
        for moment in range(count):
            name = names[moment % len(names)]
            number = signals[moment // len(names) % len(signals)]
            states, seconds = known[name]
            code, found = place.stopped(name, number, chance.uniform(0.2, 1.1) * seconds, states)
            yield name, number, code, found


def main() -> int:
    """Print the faults, and how commands ended."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moments", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--command", action="append", choices=NAMES)
    arguments = parser.parse_args()
    ends: collections.Counter[tuple[str, str, str]] = collections.Counter()
    faults = 0
    names = tuple(arguments.command or NAMES)
    for name, number, code, found in moments(arguments.moments, arguments.seed, names):
        ends[name, number.name, "stopped" if code else "ended"] += 1
        faults += bool(found)
        if found:
            print(f"{name}, {number.name}: {'; '.join(found)}", flush=True)
    for (name, signal_name, how), count in sorted(ends.items()):
        print(f"{name:14} {signal_name:8} {how:8} {count:4}")
    print(f"{arguments.moments} moments, {faults} with faults")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
