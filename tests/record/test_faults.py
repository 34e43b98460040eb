"""`msgflow watch` where things go wrong, with the real LTTng: it says so, and goes on."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
from support.lttng_program import free_port, lttng
from watch_load import build_program

from msgflow.database import Database

CONTEXTS = [f"--type={name}" for name in ("vpid", "vtid", "procname")]


class Watched:
    """A watcher that runs, and what it has shown and said so far."""

    def __init__(self, *words: object) -> None:
        options = ("--json", "--window", "1s", "--step", "1s")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "msgflow", "watch", *options, *map(str, words)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.windows: list[dict[str, Any]] = []
        self.said = ""
        self._threads = [Thread(target=self._read), Thread(target=self._hear)]
        for thread in self._threads:
            thread.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.windows.append(json.loads(line))

    def _hear(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            self.said += line

    @property
    def last(self) -> set[str]:
        """The paths of the last window that have flows."""
        paths = self.windows[-1]["paths"] if self.windows else []
        return {path["path"] for path in paths if path["reached"]}

    def wait_for(self, is_so: Callable[[], bool], seconds: float = 60) -> None:
        end = time.monotonic() + seconds
        while not is_so():
            assert time.monotonic() < end, (self.said, self.windows[-1:])
            assert self._process.poll() is None, self.said
            time.sleep(0.1)

    def __enter__(self) -> Watched:
        return self

    def __exit__(self, *error: object) -> None:
        self._process.kill()
        self.finish()

    def end(self) -> int:
        """End it by Ctrl-C, and return its exit code."""
        self._process.send_signal(signal.SIGINT)
        return self.finish()

    def finish(self) -> int:
        """Wait until it ends by itself, and return its exit code."""
        for thread in self._threads:
            thread.join()
        return self._process.wait()


@pytest.fixture(scope="module")
def load(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Start of a command that makes events: paths, events per second and seconds to name."""
    directory = tmp_path_factory.mktemp("load")
    program = build_program(directory)
    made = {"LD_LIBRARY_PATH": directory, "LD_PRELOAD": "liblttng-ust-fork.so"}
    made["LTTNG_UST_REGISTER_TIMEOUT"] = "-1"
    return ["env", *(f"{name}={value}" for name, value in made.items()), str(program)]


def create(name: str, *where: str, only: str = "") -> None:
    """Create a session that rotates each second, of all programs or of one."""
    lttng("create", name, *where)
    chosen = ["--filter", f'$ctx.procname == "{only}"'] if only else []
    lttng("enable-event", "--userspace", "ros2:*", f"--session={name}", *chosen)
    lttng("add-context", "--userspace", f"--session={name}", *CONTEXTS)
    lttng("enable-rotation", f"--session={name}", "--timer=1s")
    lttng("start", name)


@pytest.fixture
def relay(daemon: None, tmp_path: Path) -> Iterator[tuple[Path, list[str]]]:
    """A directory that lttng-relayd writes to, and how a session is created that sends there."""
    directory = tmp_path / "relayed"
    control, data, live = (f"tcp://127.0.0.1:{free_port()}" for _ in range(3))
    command = ["lttng-relayd", f"--output={directory}", "-C", control, "-D", data, "-L", live]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
        time.sleep(1)
        yield directory, [f"--ctrl-url={control}", f"--data-url={data}"]
        process.terminate()


@pytest.mark.thorough
def test_two_sources_of_lttng_relayd_of_which_one_vanishes(
    relay: tuple[Path, list[str]], load: list[str]
) -> None:
    directory, where = relay
    create("one", *where, only="path_0")
    create("two", *where, only="path_1")
    with subprocess.Popen([*load, "2", "2000", "60"]) as program, Watched(directory) as watched:
        watched.wait_for(lambda: {"/sink_0" in path for path in watched.last} == {True, False})
        lttng("destroy", "two")
        watched.wait_for(lambda: "no chunk comes any more from" in watched.said)
        watched.wait_for(lambda: {"/sink_0" in path for path in watched.last} == {True})
        program.kill()
        assert watched.end() == 0
        lttng("destroy", "one")


@pytest.mark.thorough
def test_a_hundred_restarts_of_a_node(daemon: None, load: list[str], tmp_path: Path) -> None:
    """Each is shown, as an ingest of the whole does."""
    directory = tmp_path / "drive"
    create("drive", f"--output={directory}")
    with Watched(directory) as watched:
        for _ in range(25):
            # Four nodes, for a second.
            subprocess.run([*load, "4", "8000", "1"], check=True)
        lttng("destroy", "drive")
        # The session has ended: so does the view.
        assert watched.finish() == 0
    # A node that has ended looks like one that hangs for a while.
    final = [window for window in watched.windows if window["is_final"]]
    arrived = sum(path["reached"] for window in final for path in window["paths"])
    with Database(tmp_path / "whole.duckdb") as whole:
        whole.ingest([directory])
        paths = whole.query("e2e-latency").to_arrow()
    assert arrived == sum(paths["reached"].to_pylist())
    assert sum(count > 0 for count in paths["reached"].to_pylist()) == 100
    # On a busy machine the view may lag.
    assert all("the view lags" in line for line in watched.said.splitlines()), watched.said
