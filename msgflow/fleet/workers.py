"""Workers that do tasks: this process, one after the other, or the nodes of a Ray cluster."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from msgflow.errors import UsageError
from msgflow.fleet.task import Outcome, Reason, Task, run_task
from msgflow.sql.failure import first_line
from msgflow.text.installation import install_command

LOCAL = "local"
_SCRATCH = "scratch"
_FOLDER_WITHOUT_MODULES = Path(__file__).parent / "sql"
# Tasks that wait for each worker, besides the one that it does.
_WAITING = 1


class OneProcess:
    """Does one task after the other, in this process."""

    def __init__(self) -> None:
        self._tasks: list[Task] = []

    def has_room(self) -> bool:
        """Tell whether there is nothing to do."""
        return not self._tasks

    def is_too_large(self, task: Task) -> str | None:
        """Return a reason if this machine has less memory than the task needs."""
        total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        return _too_much("memory", task.needed_memory, total)

    def submit(self, task: Task) -> None:
        """Take a task, which `wait` does."""
        self._tasks.append(task)

    def wait(self, seconds: float) -> Iterator[tuple[Task, Outcome]]:
        """Do the tasks, without a limit of time, and yield their outcomes."""
        while self._tasks:
            task = self._tasks.pop(0)
            yield task, run_task(task)

    def close(self) -> None:
        """Forget all tasks."""
        self._tasks.clear()


class RayWorkers:
    """The nodes of a Ray cluster; each task reserves its memory and scratch space."""

    def __init__(self, address: str) -> None:
        """Connect to a cluster, or start one on this machine if the address is 'local'."""
        # Ray sends no statistics of usage.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        try:
            import ray
        except ImportError as error:
            raise UsageError(
                "Ray is not installed", f"{install_command('ray')}; or leave out --ray"
            ) from error
        self._ray: Any = ray
        self._is_ours = not ray.is_initialized()
        if self._is_ours:
            # Ray knows the word 'local'. Otherwise it would join a cluster that runs here or that
            # RAY_ADDRESS names.
            more: dict[str, Any] = {"address": address}
            if address == LOCAL:
                more |= {"include_dashboard": False, "object_store_memory": 100_000_000}
            here = os.getcwd()
            # Ray's workers import from this folder first. In a foreign one, a file could have the
            # name of a module.
            os.chdir(_FOLDER_WITHOUT_MODULES)
            try:
                ray.init(
                    logging_level=logging.ERROR,
                    log_to_driver=False,
                    configure_logging=False,
                    **more,
                )
            except Exception as error:
                raise UsageError(
                    f"cannot reach the Ray cluster: {first_line(error)} — {address}",
                    "ray status --address ADDRESS; --ray local starts one of this machine",
                ) from error
            finally:
                os.chdir(here)
        # `ingest` counts the tries of a task whose worker was lost.
        self._run = ray.remote(max_retries=0)(run_task)
        self._running: dict[Any, Task] = {}

    def has_room(self) -> bool:
        """Tell whether fewer tasks wait than there are workers."""
        workers = int(self._ray.cluster_resources().get("CPU", 1))
        return len(self._running) < max(1, workers) * (1 + _WAITING)

    def is_too_large(self, task: Task) -> str | None:
        """Return a reason if no node has what the task needs."""
        nodes = [node["Resources"] for node in self._ray.nodes() if node["Alive"]]
        for name, needed in (("memory", task.needed_memory), (_SCRATCH, task.needed_disk)):
            most = max((node.get(name, 0) for node in nodes), default=0)
            if most and (words := _too_much(name, needed, int(most))):
                return words
        return None

    def submit(self, task: Task) -> None:
        """Hand a task to the cluster."""
        resources = self._ray.cluster_resources()
        # Only some clusters declare their scratch space; on others none can be reserved.
        more = {"resources": {_SCRATCH: task.needed_disk}} if resources.get(_SCRATCH) else {}
        ask = self._run.options(num_cpus=1, memory=task.needed_memory, **more)
        self._running[ask.remote(task)] = task

    def wait(self, seconds: float) -> Iterator[tuple[Task, Outcome]]:
        """Yield finished tasks; wait for the first, at most `seconds`."""
        if not self._running:
            return
        done, _ = self._ray.wait(list(self._running), num_returns=1, timeout=seconds)
        for reference in done:
            task = self._running.pop(reference)
            try:
                yield task, self._ray.get(reference)
            except self._ray.exceptions.RayError as error:
                words = f"its worker is gone ({type(error).__name__}): {first_line(error)}"
                yield task, Outcome(Reason.WORKER_LOST, "on a worker", words)

    def close(self) -> None:
        """Cancel all tasks and leave the cluster."""
        for reference in self._running:
            self._ray.cancel(reference, force=True)
        self._running.clear()
        if self._is_ours:
            self._ray.shutdown()


Workers = OneProcess | RayWorkers


def make_workers(ray: str | None) -> Workers:
    """Return the workers of a Ray cluster, or this process if no cluster is named."""
    return OneProcess() if ray is None else RayWorkers(ray)


def _too_much(what: str, needed: int, most: int) -> str | None:
    if needed <= most:
        return None
    return f"it needs some {needed:,} bytes of {what}, the largest worker has {most:,}"
