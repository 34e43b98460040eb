"""Ends commands that write at random moments, and looks at what is left.

    python benchmarks/signals.py [--moments 200] [--seed 1] [--command NAME]… [--signal NAME]…
        [--forked]

SIGINT, SIGTERM and SIGKILL meet `ingest` (into a new and into an old database), `links apply`,
`clocks apply`, `db upgrade` and `export` in turn, each at a moment between its start and a little
behind its usual end. Afterwards the database has to be the old or the new one (by the rows of its
runs), `check --detail` clean, and after one more command nothing else may lie in its directory.
Exit code 1 otherwise.

What gets a signal is started as a user starts it, or with `--forked` forked from a process that has
imported all of msgflow, as the commands before and after are: then it costs less, and no signal
comes before its first statement.
"""

from __future__ import annotations

import argparse
import collections
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import duckdb

SECONDS = 600
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


@dataclass(frozen=True)
class Done:
    """How a command without a signal ended, and what it printed."""

    code: int
    said: str


Start = Callable[[Sequence[str], int], int]


def spawned(arguments: Sequence[str], output: int) -> int:
    """Start a command line as a user does, its output to a file; return the process."""
    duplicates = [(os.POSIX_SPAWN_DUP2, output, stream) for stream in (1, 2)]
    line = [*MSGFLOW, *arguments]
    # Background jobs of a shell ignore SIGINT, and so would what they start.
    return os.posix_spawn(line[0], line, os.environ, file_actions=duplicates, setsigdef=SIGNALS[:2])


def forked(arguments: Sequence[str], output: int) -> int:
    """Start a command line in a process that has all of this one; otherwise the same."""
    pid = os.fork()
    if pid:
        return pid
    code = 1
    try:
        os.dup2(output, 1)
        os.dup2(output, 2)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.argv = ["msgflow", *arguments]
        main_of_msgflow()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def main_of_msgflow() -> None:
    """Run the program; what it would do at its end is done here."""
    from msgflow.__main__ import main

    try:
        main()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()


def ended(
    start: Start, arguments: Sequence[object], meanwhile: Callable[[int], None] = lambda pid: None
) -> Done:
    """Start a command line, do something with its process, and wait for its end."""
    with tempfile.TemporaryFile() as output:
        pid = start([str(argument) for argument in arguments], output.fileno())
        meanwhile(pid)
        until = time.monotonic() + SECONDS
        while not (found := os.waitpid(pid, os.WNOHANG))[0]:
            if time.monotonic() > until:
                os.kill(pid, signal.SIGKILL)
            time.sleep(0.005)
        output.seek(0)
        said = output.read().decode("utf-8", "replace")
    return Done(os.waitstatus_to_exitcode(found[1]), said)


def run(*arguments: object) -> Done:
    """Run a command line to its end, in a process forked from this one."""
    return ended(forked, arguments)


def state(database: Path) -> object:
    """Return what distinguishes the old database from the new one."""
    if not database.exists():
        return None
    with duckdb.connect(str(database), read_only=True) as con:
        views = con.execute("SELECT count(*) FROM duckdb_views() WHERE NOT internal").fetchall()
        return con.execute(STATE).fetchall(), views


class Place:
    """A directory with a database, in which one command is run over and over."""

    def __init__(self, root: Path, start: Start = spawned) -> None:
        self.start = start
        self.trace, self.other = root / "robot", root / "pair"
        self.old, self.stale = root / "old.duckdb", root / "stale.duckdb"
        self.links = root / "links.yaml"
        for system, path in (("pipeline", self.trace), ("two_hosts", self.other)):
            assert run("simulate", system, "-o", path, "--factor", "0.02").code == 0
        assert run("ingest", self.other, "--db", self.old).code == 0
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
            "export": (
                self.old,
                ["export", "parquet", "-o", self.directory / "out", "--force", *there],
            ),
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
            for command in (("db", "upgrade"), ("info",)):
                done = run(*command, *there)
                if done.code:
                    found.append(f"{' '.join(command)}: {done.code} {done.said}")
        else:
            run("ingest", self.trace, *there)
        if (self.directory / "out").exists():
            again = run("export", "parquet", "-o", self.directory / "out", "--force", *there)
            if again.code:
                found.append(f"export again: {again.code} {again.said}")
            found += [path.name for path in (self.directory / "out").glob(".*")]
        left = set(os.listdir(self.directory)) - {self.database.name, "out"}
        return found + sorted(left)

    def known(self, name: str) -> tuple[list[object], float]:
        """Run a command without a signal; return the states before and after, and the seconds."""
        before, command = self.commands()[name]
        self.prepare(before)
        states, began = [state(self.database)], time.monotonic()
        done = ended(self.start, command)
        assert done.code == 0, done.said
        return [*states, state(self.database)], time.monotonic() - began

    def stopped(
        self, name: str, number: signal.Signals, after: float, states: list[object]
    ) -> tuple[int, list[str]]:
        """Run a command and send it a signal; return its exit code, and what is wrong then."""
        before, command = self.commands()[name]
        self.prepare(before)

        def stop(pid: int) -> None:
            time.sleep(after)
            os.kill(pid, number)

        done = ended(self.start, command, stop)
        found = self.faults(number, done.code, states)
        # Until its first import of ours, Python answers for itself.
        if "unexpected" in done.said or ("Traceback" in done.said and "msgflow" in done.said):
            found.append(done.said)
        return done.code, found


def moments(
    count: int,
    seed: int,
    names: Sequence[str] = NAMES,
    signals: Sequence[signal.Signals] = SIGNALS,
    start: Start = spawned,
) -> Iterator[tuple[str, signal.Signals, int, list[str]]]:
    """Yield command, signal, exit code and faults of so many random moments."""
    # For the processes forked from this one.
    import msgflow.database
    import msgflow.export
    import msgflow.ingest  # noqa: F401
    import msgflow_sim  # noqa: F401

    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as directory:
        place = Place(Path(directory), start)
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
    parser.add_argument("--signal", action="append", choices=[number.name for number in SIGNALS])
    parser.add_argument("--forked", action="store_true")
    arguments = parser.parse_args()
    ends: collections.Counter[tuple[str, str, str]] = collections.Counter()
    faults = 0
    names = tuple(arguments.command or NAMES)
    signals = [signal.Signals[name] for name in arguments.signal or ()] or SIGNALS
    start = forked if arguments.forked else spawned
    for name, number, code, found in moments(
        arguments.moments, arguments.seed, names, signals, start
    ):
        ends[name, number.name, "stopped" if code else "ended"] += 1
        faults += bool(found)
        if found:
            print(f"{name}, {number.name}: {'; '.join(found)}", flush=True)
        if ends.total() % 50 == 0:
            print(f"{ends.total()} moments, {faults} with faults", flush=True)
    for (name, signal_name, how), count in sorted(ends.items()):
        print(f"{name:14} {signal_name:8} {how:8} {count:4}")
    print(f"{arguments.moments} moments, {faults} with faults")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
