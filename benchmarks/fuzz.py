"""Damages what msgflow reads, at random, and looks at what it makes of it.

    python benchmarks/fuzz.py [--cases 10000] [--first 0] [--seed 1] [--jobs N] [--kind KIND]…
        [--case N]…

Each case changes a small recording, an archive of one, a database or a name in it, a file of links
or clocks, a manifest, a lake, a bag, the chunks of a rotated recording, or the parameters of a
page, and runs all of msgflow on it in a process with limits: ingest, check, and three queries, or
what `fleet`, `bag`, `watch`, `export` or `ui` do with it. The process is forked from one that has
done all that with a recording as it was, so that no case pays for imports and for what is kept of
`schema/`.
Counted are, by kind of input:

- traceback: one is printed; mistake: an error says "mistake of msgflow"; crash: the process ends by
  a signal; hang: it takes longer, or more output, than it may;
- damage: a failed ingest changed the database, a stored run breaks a rule, or a file outside of a
  lake changed;
- unreported: a query answers otherwise than without the change, and no finding, warning or error
  says that anything was wrong.

Bytes of a payload, and names in the metadata, are protected by nothing in the format: such changes
are made as well, but cannot be unreported. A case is the same for the same seed and number;
`--case N` runs it alone and prints what was said, `--first` begins with another than the first.
Every hundred cases a line tells how many there were. The exit code is 1 where anything was counted,
or where a case was not done.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from support.mutations import (
    ANYWHERE,
    MUTATIONS,
    STRUCTURAL,
    damage_archive,
    damage_file,
    damage_text,
)

if TYPE_CHECKING:
    from msgflow import Database

SECONDS_OF_CPU = 30
# Of waiting for nothing, even where other processes have the machine.
SECONDS = 900
ADDRESS_SPACE = 8 << 30
LARGEST_FILE = 400 << 20
BAD = ("traceback", "mistake", "crash", "hang", "damage", "unreported")
QUERIES = ("e2e-latency", "topics-delivery", "topics-latency")
BASES = (("pipeline", "jazzy"), ("two_hosts", "humble-fastdds"), ("services", "jazzy"))
LENGTH = 0.004

LINKS = """links:
  - kind: partial_sync
    node: /perception/detector
    inputs:
      - /camera/image
      - /scan
    outputs: /perception/detections
"""
CLOCKS = """clocks:
  {host}:
    offset_ns: 1000
    drift_ppb: 3
"""
CLOCKS_TOML = """[{host}]
offset_ns = 1_000
drift_ppb = 3
"""
MANIFESTS = {
    "m.csv": "path,robot,version\nr0,r1,1.0\n../r1,r2,\n",
    "m.jsonl": '{"path": "r0", "robot": "r1", "year": 2025}\n{"path": "../r1", "robot": null}\n',
}
# Name of the file, its content, and the option that takes it.
FILES = {
    "links": ("links.yaml", LINKS, "--links"),
    "clocks": ("clocks.yaml", CLOCKS, "--clock-sync"),
    "clocks in TOML": ("clocks.toml", CLOCKS_TOML, "--clock-sync"),
}


@dataclass(frozen=True)
class Answers:
    """What the queries answer, and what was found wrong."""

    results: tuple[str, ...]
    reports: tuple[str, ...]


@dataclass(frozen=True)
class Base:
    """A recording to be changed.

    Attributes:
        directory: its traces.
        database: the same, ingested.
        archives: the same, packed.
        lake: the same, in a lake.
        hosts: names of its hosts.
        answers: what is said of it unchanged.
    """

    directory: Path
    database: Path
    archives: tuple[Path, ...]
    lake: Path
    hosts: tuple[str, ...]
    answers: Answers


@dataclass(frozen=True)
class Outcome:
    """What became of a case.

    Attributes:
        number: of the case.
        kind: of input.
        change: what was done.
        bad: what of `BAD` it is; empty if all is well.
        said: what was printed.
    """

    number: int
    kind: str
    change: str
    bad: tuple[str, ...]
    said: str
    ending: str


def prepare(directory: Path) -> list[Base]:
    """Simulate and ingest the recordings; in processes, since what forks must have no threads."""
    return [_base(directory, *base) for base in BASES]


def _base(directory: Path, system: str, layout: str) -> Base:
    place = directory / system
    place.mkdir()
    traces, database = place / "copy", place / "run.duckdb"
    empty = directory / "empty.duckdb"

    def make() -> dict[str, Any]:
        from msgflow.db import migration
        from msgflow_sim import simulate

        if not empty.exists():
            migration.create(empty)
        shutil.copyfile(empty, database)
        simulation = simulate(system, place / "trace", factor=LENGTH, layout=layout)
        shutil.copytree(
            simulation.directory, traces, ignore=shutil.ignore_patterns("truth", "*.json")
        )
        meta = json.loads((simulation.directory / "truth" / "meta.json").read_text())
        forms = ("tar", "gztar", "xztar", "zip")
        archives = [shutil.make_archive(str(place / "robot"), form, traces) for form in forms]
        return {"hosts": list(meta["hosts"]), "archives": archives}

    ending, made, said = run(make, place)
    if ending == "ended":
        ending, found, said = run(lambda: commands(database, [traces], []), place)
    lake = place / "lake"
    if ending == "ended":
        ending, _, said = run(lambda: ingest_into_lake(traces, lake), place)
    if ending != "ended" or not found.get("results"):
        raise SystemExit(f"cannot prepare {system}: {said}")
    archives = tuple(map(Path, made["archives"]))
    return Base(traces, database, archives, lake, tuple(made["hosts"]), answers_of(found, place))


def commands(database: Path, traces: Sequence[Path], options: Sequence[str]) -> dict[str, Any]:
    """Run msgflow; runs in a process of its own.

    What reads a database opens it once: opening takes as long as a query. What it raises that is no
    error of msgflow is a traceback.
    """
    from msgflow import MsgflowError, open_db

    found: dict[str, Any] = {"codes": []}
    before = database.read_bytes()
    if traces:
        code, _ = msgflow("ingest", *map(str, traces), "--db", str(database), *options)
        found["codes"].append(code)
        if code:
            found["damaged"] = database.read_bytes() != before
            return found
    else:
        code, _ = msgflow("check", "--db", str(database))
        found["codes"].append(code)
    found["damaged"] = False
    try:
        with open_db(database) as opened:
            found["reports"] = [str(opened.findings()), written(opened, "info-findings")]
            results = [written(opened, query) for query in QUERIES]
            if traces:
                found["damaged"] = bool(opened.check())
        found["results"] = results
    except MsgflowError as error:
        print(f"error: {error}", file=sys.stderr)
        found["codes"].append(int(error.exit_code))
        # What msgflow has just written, it has to be able to read.
        found["damaged"] = bool(traces)
    if not traces:
        found["damaged"] = database.read_bytes() != before
    return found


def ingest_into_lake(traces: Path, lake: Path) -> dict[str, Any]:
    """Make a lake of a recording; runs in a process of its own."""
    code, _ = msgflow("fleet", "ingest", str(traces), "--lake", str(lake))
    if code:
        raise SystemExit(code)
    return {"codes": [code]}


def lake_commands(lake: Path, outside: Path) -> dict[str, Any]:
    """Do with a lake all that `fleet` can do; nothing outside may change."""

    def state() -> list[tuple[str, bytes | None]]:
        return [
            (str(path), path.read_bytes() if path.is_file() else None)
            for path in sorted(outside.rglob("*"))
        ]

    before, place = state(), ("--lake", str(lake))
    codes = [
        msgflow("fleet", *words, *place)[0]
        for words in (
            ("runs",),
            ("failures",),
            ("query", "e2e-latency"),
            ("sql", "FROM run"),
            ("worst", "*"),
            ("open", "copy", "-o", str(lake.with_name("opened.duckdb"))),
            ("remove",),
            ("runs",),
        )
    ]
    return {"codes": [max(codes)], "damaged": state() != before}


def damage_lake(lake: Path, outside: Path, random: Random) -> str:
    """Change a file of a lake, or put something else in its place."""
    file = random.choice(sorted(path for path in lake.rglob("*") if path.is_file()))
    name = file.relative_to(lake)
    kind = random.choice(("damage", "damage", "damage", "pipe", "link", "folder", "gone", "other"))
    if kind == "damage":
        return f"{name}: {damage_file(file, random)}"
    if kind == "other":
        other = random.choice(sorted(path for path in lake.rglob("*") if path.is_file()))
        shutil.copyfile(other, file.with_name(f"{random.randrange(9)}{file.name}"))
        file.write_bytes(other.read_bytes())
        return f"{name}: the content of {other.relative_to(lake)}"
    if kind == "folder":
        # The folder of a part leads to another place.
        folder = file.parent if file.parent != lake else lake / "flow"
        moved = outside / folder.name
        shutil.move(folder, moved)
        folder.symlink_to(moved)
        return f"{folder.relative_to(lake)}: a link to a folder outside"
    file.unlink()
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "link":
        file.symlink_to(outside / "file")
    return f"{name}: {kind}"


def written(database: Database, query: str) -> str:
    """Return what a query answers, as the command line writes it."""
    import io

    from msgflow.export.formats import Format, write_result

    stream = io.BytesIO()
    write_result(database.query(query), Format.JSON, stream)
    return stream.getvalue().decode("utf-8", "replace")


def msgflow(*arguments: str) -> tuple[int, str]:
    """Run a command in this process; return its exit code and what it printed to stdout."""
    from msgflow.cli.app import app

    with tempfile.TemporaryFile() as output:
        kept = os.dup(1)
        os.dup2(output.fileno(), 1)
        try:
            app(list(arguments))
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
        finally:
            with contextlib.suppress(OSError):
                sys.stdout.flush()
            os.dup2(kept, 1)
            os.close(kept)
        output.seek(0)
        return code, output.read().decode("utf-8", "replace")


def run(work: Callable[[], dict[str, Any]], directory: Path) -> tuple[str, dict[str, Any], str]:
    """Do something in a process with limits; return how it ended, what it returned and said."""
    stderr, result = directory / "stderr", directory / "result"
    pid = os.fork()
    if pid == 0:
        status = 1
        try:
            descriptor = os.open(stderr, os.O_CREAT | os.O_TRUNC | os.O_WRONLY)
            os.dup2(descriptor, 2)
            os.dup2(descriptor, 1)
            os.environ["TMPDIR"] = str(directory)
            tempfile.tempdir = None
            for limit, value in (
                (resource.RLIMIT_AS, ADDRESS_SPACE),
                (resource.RLIMIT_CPU, SECONDS_OF_CPU),
                (resource.RLIMIT_FSIZE, LARGEST_FILE),
                (resource.RLIMIT_CORE, 0),
            ):
                resource.setrlimit(limit, (value, value))
            result.write_text(json.dumps(work()))
            status = 0
        except BaseException as error:
            traceback.print_exception(error)
        finally:
            with contextlib.suppress(Exception):
                sys.stderr.flush()
            os._exit(status)
    ending = wait(pid)
    said = stderr.read_text("utf-8", "replace") if stderr.exists() else ""
    found = json.loads(result.read_text()) if ending == "ended" and result.exists() else {}
    return ending, found, said


def wait(pid: int) -> str:
    """Wait for a process, but not for ever; say how it ended."""
    until = time.monotonic() + SECONDS
    while time.monotonic() < until:
        done, status, usage = os.wait4(pid, os.WNOHANG)
        if done:
            if not os.WIFSIGNALED(status):
                return "ended" if os.WEXITSTATUS(status) == 0 else "failed"
            number = os.WTERMSIG(status)
            is_limit = number in {signal.SIGXCPU, signal.SIGXFSZ} or (
                number == signal.SIGKILL and usage.ru_utime + usage.ru_stime > SECONDS_OF_CPU - 1
            )
            return "hang" if is_limit else f"crash by signal {number}"
        time.sleep(0.005)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    return "hang"


def answers_of(found: dict[str, Any], directory: Path) -> Answers:
    """Return what can be compared: without the place of the case."""

    def plain(texts: Sequence[str]) -> tuple[str, ...]:
        return tuple(text.replace(str(directory), "") for text in texts)

    return Answers(plain(found.get("results", ())), plain(found.get("reports", ())))


def case(
    number: int, seed: int, bases: Sequence[Base], kinds: Sequence[str], place: Path
) -> Outcome:
    """Run one case in an empty directory."""
    random = Random(f"{seed} {number}")
    kind = random.choice(kinds)
    base = bases[random.randrange(len(bases))]
    database = place / "run.duckdb"
    empty = base.directory.parents[1] / "empty.duckdb"
    shutil.copyfile(base.database if kind == "database" else empty, database)
    traces, options, protected = [base.directory], [], True
    if kind == "trace":
        traces = [place / "copy"]
        shutil.copytree(base.directory, traces[0])
        directories = sorted(path.parent for path in traces[0].rglob("metadata"))
        changes = []
        for _ in range(random.choice((1, 1, 1, 2))):
            directory = random.choice(directories)
            mutation = random.choice((*MUTATIONS, *STRUCTURAL))
            protected &= mutation not in ANYWHERE
            with contextlib.suppress(OSError, IndexError, ValueError):
                changes.append(f"{mutation.__name__}: {mutation(directory, random)}")
        change = "; ".join(changes)
    elif kind == "archive":
        archive = random.choice(base.archives)
        traces = [place / archive.name]
        shutil.copyfile(archive, traces[0])
        change = f"{archive.suffix}: {damage_archive(traces[0], random)}"
        # A plain tar has no sums of its contents.
        protected = archive.suffix != ".tar"
    elif kind == "database":
        change, traces, protected = damage_file(database, random), [], False
    elif kind in ("lake", "manifest"):
        return case_of_fleet(number, kind, base, place, random)
    elif kind in OTHERS:
        outside = place / "outside"
        outside.mkdir()
        (outside / "file").write_text("mine")
        shutil.copyfile(base.database, database)
        change, work = OTHERS[kind](base, place, random)
        ending, found, said = run(lambda: unchanged(outside, work), place)
        refused = any(found.get("codes", ()))
        bad = faults(ending, found, said)
        return Outcome(number, kind, change, tuple(bad), said, "refused" if refused else ending)
    else:
        name, text, option = FILES[kind]
        content, change = damage_text(text.replace("{host}", random.choice(base.hosts)), random)
        file = place / name
        file.write_bytes(content)
        options = [option, str(file)]
        protected = False
    ending, found, said = run(lambda: commands(database, traces, options), place)
    bad = faults(ending, found, said)
    if protected and "results" in found:
        answers, usual = answers_of(found, place), base.answers
        if answers.results != usual.results and answers.reports == usual.reports:
            bad.append("unreported")
    refused = bool(found.get("codes")) and found["codes"][0] != 0 and "results" not in found
    return Outcome(number, kind, change, tuple(bad), said, "refused" if refused else ending)


def case_of_fleet(number: int, kind: str, base: Base, place: Path, random: Random) -> Outcome:
    """Run one case with a changed lake, or a changed manifest."""
    outside, lake = place / "outside", place / "lake"
    outside.mkdir()
    (outside / "file").write_text("mine")
    if kind == "lake":
        shutil.copytree(base.lake, lake)
        change = damage_lake(lake, outside, random)

        def work() -> dict[str, Any]:
            return lake_commands(lake, outside)

    else:
        name, text = random.choice(sorted(MANIFESTS.items()))
        content, change = damage_text(text, random)
        change = f"{name}: {change}"
        (place / name).write_bytes(content)

        def work() -> dict[str, Any]:
            code, _ = msgflow("fleet", "ingest", str(place / name), "--lake", str(lake))
            return {"codes": [code]}

    ending, found, said = run(work, place)
    refused = bool(found.get("codes")) and found["codes"][0] != 0
    bad = tuple(faults(ending, found, said))
    return Outcome(number, kind, change, bad, said, "refused" if refused else ending)


def unchanged(outside: Path, work: Callable[[], list[int]]) -> dict[str, Any]:
    """Do something; nothing outside may change."""

    def state() -> list[tuple[str, bytes]]:
        return [(path.name, path.read_bytes()) for path in sorted(outside.iterdir())]

    before = state()
    codes = work()
    return {"codes": codes, "damaged": state() != before}


ODD_NAMES = (
    "../../outside/file", "/a, /b", "=1+1", "\x1b[31m", "\r", "\u2028", " ", "'; DROP TABLE x; --",
    "-", "a" * 5000, "\U0001f916", "%s{}", "*?[", "..", "\x7f\x85",
)  # fmt: skip


def odd_names(base: Base, place: Path, random: Random) -> tuple[str, Callable[[], list[int]]]:
    """Give things of a database odd names: topics, nodes, files of its views."""
    import duckdb

    name = random.choice(ODD_NAMES)
    table, column = random.choice(
        (("publisher", "topic_name"), ("subscription", "topic_name"), ("node", "name"),
         ("node", "namespace"), ("trace", "hostname"), ("run", "name"), ("process", "procname"))
    )  # fmt: skip
    with duckdb.connect(str(place / "run.duckdb")) as connection:
        with contextlib.suppress(duckdb.Error):
            connection.execute(f"UPDATE store.{table} SET {column} = ?", [name])
        connection.execute(f'CREATE VIEW main."{name.replace(chr(34), "")}" AS SELECT 1 AS x')
    given = ("--db", str(place / "run.duckdb"))
    words = random.choice(
        (("export", "csv", "-o", str(place / "out")), ("export", "parquet", "-o", str(place / "o")),
         ("report", "-o", str(place / "r.html")), ("graph",), ("suggest", "paths"), ("why",),
         ("query", "flows", "--from", name), ("query", "e2e-latency", "--format", "csv"))
    )  # fmt: skip
    return f"{table}.{column} = {name[:30]!r}: {' '.join(words[:2])}", lambda: [
        msgflow(*words, *given)[0]
    ]


def odd_chunks(base: Base, place: Path, random: Random) -> tuple[str, Callable[[], list[int]]]:
    """Put junk beside the chunks of a recording, and damage one; watch reads it."""
    changes = []
    for source in sorted({path.parents[1] for path in base.directory.rglob("ust/uid")}):
        archives = place / "live" / source.name / "archives"
        for number in range(2):
            span = f"20260314T09260{number}+0000-20260314T09260{number + 1}+0000"
            shutil.copytree(source, archives / f"{span}-{number}")
        junk = archives / random.choice(
            ("20990101T000000+0000-20990101T000001+0000-77", "20260314T092601+0000-x-1", "notes",
             "20260314T092602+0000-20260314T092603+0000-2", "99999999T999999+0000-0-1",
             "20260314T092602+0000-20260314T092603+0000-99999999999999999999")
        )  # fmt: skip
        made = random.choice(("folder", "file", "pipe", "link", "damage"))
        if made == "folder":
            junk.mkdir()
        elif made == "file":
            junk.write_bytes(random.randbytes(99))
        elif made == "pipe":
            os.mkfifo(junk)
        elif made == "link":
            junk.symlink_to(place)
        else:
            file = random.choice(sorted(path for path in archives.rglob("*") if path.is_file()))
            changes.append(damage_file(file, random))
        changes.append(f"{made} {junk.name}")
    words = ("watch", str(place / "live"), "--once", "--json")
    return "; ".join(changes), lambda: [msgflow(*words)[0]]


def odd_bag(base: Base, place: Path, random: Random) -> tuple[str, Callable[[], list[int]]]:
    """Damage a bag."""
    from rosbags import rosbag2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)
    plugin = random.choice(list(rosbag2.StoragePlugin))
    bag = place / "bag"
    writer = rosbag2.Writer(bag, version=9, storage_plugin=plugin)
    mode = random.choice(list(rosbag2.CompressionMode))
    if mode is rosbag2.CompressionMode.STORAGE and plugin is rosbag2.StoragePlugin.SQLITE3:
        mode = rosbag2.CompressionMode.NONE
    writer.set_compression(mode, rosbag2.CompressionFormat.ZSTD)
    with writer:
        topic = writer.add_connection("/camera/image", "std_msgs/msg/String", typestore=store)
        for at in range(50):
            writer.write(topic, at, b"\0\1\0\0\x06\0\0\0hello\0")
    file = random.choice(sorted(bag.iterdir()))
    change = f"{plugin.name}, {mode.name}, {file.name}: {damage_file(file, random)}"
    return change, lambda: [msgflow("bag", str(bag), "--db", str(place / "run.duckdb"))[0]]


def odd_parameters(base: Base, place: Path, random: Random) -> tuple[str, Callable[[], list[int]]]:
    """Ask pages with parameters that they do not expect."""
    from msgflow.view.pages import ANSWERS

    name = random.choice(sorted(ANSWERS))
    words = ("run", "start", "end", "bins", "limit", "kind", "id", "other", "path", "part", "of",
             "what", "width", "quick", "node", "flow")  # fmt: skip
    values = (*ODD_NAMES, "0", "-1", "1e308", "nan", str(2**63), str(-(2**63)), "1000000000", "[]",
              "{}", "null", "1.5", "publication")  # fmt: skip
    params = {word: random.choice(values) for word in random.sample(words, random.randrange(6))}
    if random.random() < 0.8:
        params["run"] = "1"

    def ask() -> list[int]:
        import duckdb

        from msgflow import MsgflowError
        from msgflow.view.shared_database import SharedDatabase

        shared = SharedDatabase(place / "run.duckdb", "1GB")
        try:
            shared.answer(name, params, None, lambda _: None)
        except MsgflowError as error:
            print(f"error: {error}", file=sys.stderr)
            return [1]
        except duckdb.Error as error:
            # The page gets status 500.
            print(f"mistake of msgflow: {error}", file=sys.stderr)
            return [1]
        finally:
            shared.close()
        return [0]

    return f"{name} {params}"[:300], ask


OTHERS = {"name": odd_names, "chunk": odd_chunks, "bag": odd_bag, "parameter": odd_parameters}


def faults(ending: str, found: dict[str, Any], said: str) -> list[str]:
    """Return what of `BAD` a process shows."""
    is_so = {
        "traceback": "Traceback (most recent call last)" in said,
        "mistake": "mistake of msgflow" in said,
        "hang": ending == "hang",
        "crash": ending.startswith("crash"),
        "damage": bool(found.get("damaged")),
    }
    return [name for name in BAD if is_so.get(name)]


def warm_up(bases: Sequence[Base]) -> None:
    """Do once, in this process, what each case does in one forked from it."""
    base = bases[0]
    with tempfile.TemporaryDirectory() as temporary, open(os.devnull, "w") as nothing:
        database = Path(temporary) / "run.duckdb"
        shutil.copyfile(base.directory.parents[1] / "empty.duckdb", database)
        kept = os.dup(2)
        os.dup2(nothing.fileno(), 2)
        try:
            commands(database, [base.directory], [])
            msgflow("check", "--db", str(database))
        finally:
            os.dup2(kept, 2)
            os.close(kept)
    # What is there now is not looked through for garbage again, and stays shared with the cases.
    gc.collect()
    gc.freeze()


def worker(
    numbers: Sequence[int], seed: int, bases: Sequence[Base], kinds: Sequence[str], write: int
) -> None:
    """Run cases one after the other; send each outcome as a line."""
    warm_up(bases)
    with os.fdopen(write, "w") as stream, tempfile.TemporaryDirectory() as temporary:
        for number in numbers:
            place = Path(temporary) / str(number)
            place.mkdir()
            outcome = case(number, seed, bases, kinds, place)
            shutil.rmtree(place, ignore_errors=True)
            stream.write(json.dumps(vars(outcome)) + "\n")
            stream.flush()


def outcomes(
    numbers: Sequence[int], seed: int, bases: Sequence[Base], kinds: Sequence[str], jobs: int
) -> Iterator[Outcome]:
    """Run cases in several processes, which have imported everything before they fork for each."""
    import selectors

    import duckdb  # noqa: F401
    import numpy  # noqa: F401
    import pyarrow.compute  # noqa: F401

    import msgflow.cli.app
    import msgflow.database
    import msgflow.ingest  # noqa: F401

    with selectors.DefaultSelector() as selector:
        for job in range(jobs):
            read, write = os.pipe()
            if os.fork() == 0:
                os.close(read)
                try:
                    worker(numbers[job::jobs], seed, bases, kinds, write)
                except BaseException:
                    traceback.print_exc()
                finally:
                    os._exit(0)
            os.close(write)
            selector.register(os.fdopen(read), selectors.EVENT_READ)
        while selector.get_map():
            for key, _ in selector.select():
                line = key.fileobj.readline()  # type: ignore[union-attr]
                if not line:
                    selector.unregister(key.fileobj)
                    continue
                row = json.loads(line)
                yield Outcome(**{**row, "bad": tuple(row["bad"])})


KINDS = (
    *("trace",) * 12,
    *("archive",) * 3,
    *("database",) * 2,
    *FILES,
    *("lake",) * 2,
    "manifest",
    *OTHERS,
)


def campaign(
    numbers: Sequence[int],
    seed: int,
    kinds: Sequence[str] = KINDS,
    jobs: int = 1,
    report: Callable[[Outcome], None] = lambda outcome: None,
) -> list[Outcome]:
    """Run these cases and return what became of them."""
    found = []
    with tempfile.TemporaryDirectory() as temporary:
        bases = prepare(Path(temporary))
        for outcome in outcomes(numbers, seed, bases, kinds, jobs):
            report(outcome)
            found.append(outcome)
    return found


def main() -> None:
    """Run the campaign and print what was counted."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--kind", action="append", choices=sorted(set(KINDS)))
    parser.add_argument("--case", action="append", type=int, help="only this one")
    arguments = parser.parse_args()
    numbers = arguments.case or range(arguments.first, arguments.first + arguments.cases)
    begin, done = time.monotonic(), Counter[bool]()

    def report(outcome: Outcome) -> None:
        if outcome.bad or arguments.case:
            said = outcome.said.strip().splitlines()
            shown = said if arguments.case else said[-3:]
            print(
                f"case {outcome.number} ({outcome.kind}): {', '.join(outcome.bad) or 'well'} "
                f"[{outcome.ending}] — {outcome.change}",
                *(f"    {line[:300]}" for line in shown),
                sep="\n",
                flush=True,
            )
        done[bool(outcome.bad)] += 1
        if done.total() % 100 == 0:
            print(f"{done.total()} cases, {done[True]} of them not well", flush=True)

    kinds = tuple(arguments.kind or KINDS)
    found = campaign(numbers, arguments.seed, kinds, arguments.jobs, report)
    print(f"\n{'kind':15}{'cases':>8}{'refused':>9}" + "".join(f"{bad:>12}" for bad in BAD))
    for kind in sorted({outcome.kind for outcome in found}):
        of_kind = [outcome for outcome in found if outcome.kind == kind]
        counts = Counter(bad for outcome in of_kind for bad in outcome.bad)
        refused = sum(outcome.ending == "refused" for outcome in of_kind)
        print(f"{kind:15}{len(of_kind):8}{refused:9}" + "".join(f"{counts[bad]:12}" for bad in BAD))
    bad = sum(bool(outcome.bad) for outcome in found)
    print(f"\n{len(found)} cases in {time.monotonic() - begin:.0f} s, {bad} of them not well")
    # A process that does cases may have been killed itself.
    if left := set(numbers) - {outcome.number for outcome in found}:
        print(f"{len(left)} cases were not done, from {min(left)} on", file=sys.stderr)
    sys.exit(bool(bad or left))


if __name__ == "__main__":
    main()
