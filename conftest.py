"""What all tests share: an empty database, a place for traces, the golden cases, the program."""

from __future__ import annotations

import gc
import lzma
import resource
import shutil
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import duckdb
import pytest
from hypothesis import settings
from support import thorough
from support.analysis import Analysis
from support.ingested import made_once
from typer.testing import CliRunner, Result

from msgflow.cli.app import app
from msgflow.db.migration import create
from msgflow.ingest import ingest
from msgflow.trace import bt2_library
from msgflow_sim import simulate

pytest_plugins = ["support.golden"]

ROOT = Path(__file__).resolve().parent
_QUICK = "not thorough"
_LEFT_OUT = pytest.StashKey[int]()


@pytest.fixture(scope="session", autouse=True)
def _surroundings(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The tests' own cache, and signals that are not ignored, as `&` and `nohup` of a shell do."""
    with pytest.MonkeyPatch.context() as patch:
        if thorough.is_quick:
            # Each worker has a core, and threads of DuckDB would wait for those of the others: it
            # takes as many as this says. `make test-all` leaves it as many as there are cores.
            patch.setenv("SLURM_CPUS_ON_NODE", "1")
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
            # Programs that are started do not inherit it, as they do what is ignored.
            signal.signal(signal.SIGHUP, lambda *_: None)
        yield


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--without-bt2", action="store_true", help="as if bt2 were not installed")


def pytest_configure(config: pytest.Config) -> None:
    # `make test` tries the same examples each time: who changes one thing is not told of another.
    settings.register_profile("same", derandomize=True)
    thorough.is_quick = config.option.markexpr == _QUICK
    if thorough.is_quick:
        settings.load_profile("same")
    if config.getoption("--without-bt2"):
        # An import of it fails then as where it is missing, and no other place is searched.
        sys.modules["bt2"] = None  # type: ignore[assignment]
        bt2_library.PREFIXES = ()


def pytest_collection_finish() -> None:
    """Look for garbage less often, and not among the tests: that took a tenth of their time."""
    gc.freeze()
    gc.set_threshold(50_000)


def pytest_sessionfinish() -> None:
    gc.unfreeze()  # else what is frozen outlives the libraries that it belongs to


def pytest_deselected(items: Sequence[pytest.Item]) -> None:
    """Count the thorough tests that are left out, also for the process that has started this."""
    left_out = [item for item in items if item.get_closest_marker("thorough")]
    if left_out:
        config = left_out[0].config
        config.stash[_LEFT_OUT] = len(left_out)
        getattr(config, "workeroutput", {})["left_out"] = len(left_out)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Take what a worker has counted; each counts all."""
    node.config.stash[_LEFT_OUT] = getattr(node, "workeroutput", {}).get("left_out", 0)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say what the tests cost, and how many `make test` leaves to `make test-all`."""
    # Workers are children, and so is what they started: all have ended.
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    seconds = sum(each.ru_utime + each.ru_stime for each in used)
    terminalreporter.write_line(f"{seconds:,.0f} s of CPU")
    config = terminalreporter.config
    count = config.stash.get(_LEFT_OUT, 0)
    if count and config.option.markexpr == _QUICK:
        terminalreporter.write_line(f"{count:,} thorough tests not run: make test-all")


@pytest.fixture(scope="session")
def empty_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database without a run; read it only."""
    path = tmp_path_factory.mktemp("empty") / "empty.duckdb"
    create(path)
    return path


@pytest.fixture
def fresh_database(empty_database: Path, tmp_path: Path) -> Path:
    """A database without a run, to write to."""
    path = tmp_path / "msgflow.duckdb"
    shutil.copyfile(empty_database, path)
    return path


@pytest.fixture(scope="session")
def _small_database(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    from support.golden import fill_case

    path = tmp_path_factory.mktemp("small") / "msgflow.duckdb"
    shutil.copyfile(empty_database, path)
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, ROOT / "tests" / "support" / "small_database.case")
    return path


@pytest.fixture
def small_database(_small_database: Path, tmp_path: Path) -> Path:
    """A database with two runs, a node, two topics of which one is internal, and a finding."""
    path = tmp_path / "msgflow.duckdb"
    shutil.copyfile(_small_database, path)
    return path


@pytest.fixture(scope="session")
def analysis(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Analysis]:
    """A database for one system after the other."""
    bench = Analysis(empty_database, tmp_path_factory.mktemp("analysis"))
    yield bench
    bench.discard()


@pytest.fixture(scope="session")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Ingests a simulated system, once for all tests; `trace` is beside it. Read it only."""

    def database(system: str, factor: float) -> Path:
        def make(path: Path) -> None:
            simulate(system, path.parent / "trace", factor=factor)
            ingest([path.parent / "trace"], path)

        return made_once(tmp_path_factory, f"{system}_{factor}", make)

    return database


@pytest.fixture
def older_database(tmp_path: Path) -> Path:
    """A database whose tables another version of msgflow made.

    It is that of `examples/pipeline.tar.xz`, without its views.
    """
    path = tmp_path / "older.duckdb"
    stored = ROOT / "tests" / "support" / "older_tables.duckdb.xz"
    path.write_bytes(lzma.decompress(stored.read_bytes()))
    return path


@pytest.fixture
def msgflow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Run a command line in an empty directory, without a database in the environment."""
    directory = tmp_path / "here"
    directory.mkdir()
    monkeypatch.chdir(directory)
    monkeypatch.delenv("MSGFLOW_DB", raising=False)
    monkeypatch.delenv("MSGFLOW_DEBUG", raising=False)
    monkeypatch.delenv("MSGFLOW_MEMORY_LIMIT", raising=False)

    def run(*arguments: object, stdin: str | None = None) -> Result:
        return CliRunner().invoke(app, [str(argument) for argument in arguments], input=stdin)

    return run


@pytest.fixture(scope="session")
def shared_traces() -> Path:
    """Recorded traces, which lie beside the checkout where they are at hand."""
    path = ROOT.parent / "shared" / "traces"
    if not path.is_dir():
        pytest.skip("the recorded traces (../shared/traces) are not here")
    return path


@pytest.fixture(scope="session")
def real(shared_traces: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Ingests a recording, once for all tests."""

    def database(name: str) -> Path:
        if not (shared_traces / name).exists():
            pytest.skip(f"this recording ({name}) is not here")

        def make(path: Path) -> None:
            ingest([shared_traces / name], path)

        return made_once(tmp_path_factory, Path(name).name, make)

    return database


@pytest.fixture(scope="session")
def shared_kernel() -> Path:
    """Recordings with kernel traces, which lie beside the checkout where they are at hand."""
    path = ROOT.parent / "shared" / "kernel"
    if not path.is_dir():
        pytest.skip("the recordings with kernel traces (../shared/kernel) are not here")
    return path
