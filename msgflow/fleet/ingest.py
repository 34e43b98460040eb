"""The ingest of many recordings into a lake: gives tasks to workers and commits their results."""

from __future__ import annotations

import hashlib
import json
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from msgflow.errors import MsgflowError, TraceError, UsageError
from msgflow.fleet.file_store import S3, normal_url
from msgflow.fleet.lake import Lake
from msgflow.fleet.sources import Recording, State, find_recordings, look_at
from msgflow.fleet.task import PASSING, Options, Outcome, Reason, Task, needs, without_secrets
from msgflow.fleet.workers import Workers, make_workers

_LOOKING_AT_ONCE = 8
_SECONDS_BETWEEN_LOOKS = 0.5


@dataclass
class FleetProgress:
    """Progress of the ingest, in numbers of recordings."""

    total: int  # all recordings
    added: int = 0  # new in the lake
    replaced: int = 0  # took the place of an earlier run
    there: int = 0  # were in the lake already, unchanged
    same: int = 0  # have the packets and labels of another recording that is in the lake
    failed: int = 0  # failed now
    failed_before: int = 0  # failed in an earlier call, and were left alone
    retried: int = 0  # tries after a first one
    events: int = 0  # events of those that were added or replaced
    seconds: float = 0.0  # since the start
    workers: Counter[str] = field(default_factory=Counter)  # number of recordings by worker
    # (source, reason, error) of those that failed now.
    failures: list[tuple[str, str, str]] = field(default_factory=list)

    @property
    def done(self) -> int:
        """Number of recordings that are finished, whatever their result."""
        return self.in_lake + self.failed + self.failed_before

    @property
    def in_lake(self) -> int:
        """Number of recordings that the lake has."""
        return self.added + self.replaced + self.there + self.same

    @property
    def worked(self) -> int:
        """Number of recordings that a worker has finished."""
        return self.added + self.replaced + self.same + self.failed

    @property
    def seconds_left(self) -> float | None:
        """Estimated seconds for the rest; None as long as there is nothing to go by."""
        if not self.worked:
            return None
        return self.seconds / self.worked * (self.total - self.done)


def fleet_ingest(
    sources: Sequence[str],
    lake: str | Path,
    *,
    ray: str | None = None,
    options: Options | None = None,
    labels: Mapping[str, str] | None = None,
    shard: tuple[int, int] | None = None,
    progress: Callable[[FleetProgress], None] | None = None,
) -> FleetProgress:
    """Ingest recordings into a lake, each as one run; a failure does not stop the others.

    `shard` (I, N) does those of N parts that other processes do, 0 to N - 1.
    """
    recordings = find_recordings(sources, labels)
    url = normal_url(lake)
    # A pattern may fit the lake itself.
    recordings = [each for each in recordings if not f"{each.source}/".startswith(f"{url}/")]
    if not recordings:
        raise UsageError(f"the lake itself is no recording — {url}", "give other sources")
    opened = Lake.open(lake, create=True)
    if shard is not None:
        recordings = [each for each in recordings if is_in_shard(each.source, *shard)]
    return _Ingest(opened, recordings, options or Options(), progress).run(ray)


def is_in_shard(source: str, shard: int, shards: int) -> bool:
    """Tell whether a recording belongs to a shard: by its source alone, whatever others there are.

    So shards that list the sources at different moments still do each recording once.
    """
    digest = hashlib.sha256(source.encode(errors="surrogateescape")).digest()
    return int.from_bytes(digest[:8], "big") % shards == shard


@dataclass
class _Item:
    """A recording in progress."""

    recording: Recording
    state: State | None = None
    tries: int = 0


@dataclass
class _Ingest:
    """The state of one call: runs of the lake, tasks and progress."""

    _lake: Lake
    _recordings: Sequence[Recording]
    _options: Options
    _report: Callable[[FleetProgress], None] | None

    def __post_init__(self) -> None:
        self._begin = time.monotonic()
        self._progress = FleetProgress(len(self._recordings))
        self._runs = {row["run"]: row for row in self._lake.runs().to_pylist()}
        # Of two runs of a source, which a killed writer left, the earlier one is to go.
        latest_first = sorted(self._runs.values(), key=lambda row: -row["committed_ns"])
        self._sources = {row["source"]: row["run"] for row in latest_first}
        # Runs that this call wrote.
        self._written: set[str] = set()
        self._failed = {row["source"]: row for row in self._lake.failures().to_pylist()}
        # To try again, when all others were tried.
        self._again: list[_Item] = []

    def run(self, ray: str | None) -> FleetProgress:
        workers: Workers | None = None
        with ThreadPoolExecutor(_LOOKING_AT_ONCE) as pool:
            looked = pool.map(_look, self._recordings)
            fresh = filter(None, map(self._new, self._recordings, looked))
            try:
                running: dict[str, _Item] = {}  # by source
                while True:
                    while workers is None or workers.has_room():
                        item = next(fresh, None)
                        if item is None and self._again:
                            item = self._again.pop(0)
                        if item is None:
                            break
                        # Connect to a cluster only when there is work.
                        workers = workers or make_workers(ray)
                        self._submit(workers, item, running)
                    if not running or workers is None:
                        break
                    for task, outcome in workers.wait(_SECONDS_BETWEEN_LOOKS):
                        self._ended(running.pop(task.source), outcome)
            finally:
                pool.shutdown(wait=False, cancel_futures=True)
                if workers is not None:
                    workers.close()
        self._tell()
        return self._progress

    def _new(self, recording: Recording, found: State | MsgflowError) -> _Item | None:
        """Return the item of a recording; None if there is nothing to do."""
        item = _Item(recording)
        if isinstance(found, MsgflowError):
            item.tries = 1
            reason = Reason.BROKEN if isinstance(found, TraceError) else Reason.UNREACHABLE
            words = without_secrets(found.message)
            self._failed_now(item, Outcome(reason, "looking at the source", words, found.hint))
            return None
        item.state = found
        run = self._runs.get(self._sources.get(recording.source, ""))
        labels = dict(recording.labels)
        if run is not None and labels and dict(run["labels"] or ()) != labels:
            run = self._as_it_is_now(run["run"])
            if run is not None and self._is_there(run, recording, found):
                self._commit({**run, "labels": labels})
        if run is not None and self._is_there(run, recording, found):
            self._forget(item)
            self._progress.there += 1
            self._tell()
            return None
        failure = self._failed.get(recording.source)
        if (
            failure is not None
            and not (self._options.retry_failed or self._options.replace)
            and failure["source_signature"] == found.signature
        ):
            self._progress.failed_before += 1
            self._tell()
            return None
        return item

    def _is_there(self, run: Mapping[str, Any], recording: Recording, state: State) -> bool:
        options = self._options
        return (
            not options.replace
            and run["source"] == recording.source
            and run["source_signature"] == state.signature
            and run["options"] == json.dumps(dict(options.ingest), sort_keys=True)
            and (run["database_part"] is not None or not options.database)
        )

    def _as_it_is_now(self, key: str) -> Mapping[str, Any] | None:
        """Read a run again, as another process may have written, replaced or removed it."""
        row = self._lake.run(key)
        self._know(key, row)
        return row

    def _submit(self, workers: Workers, item: _Item, running: dict[str, _Item]) -> None:
        options = self._options
        source = item.recording.source
        assert item.state is not None
        memory, disk = needs(
            item.state.size, is_archive=item.state.is_archive, is_remote=source.startswith(S3)
        )
        task = Task(
            source,
            self._lake.store.url,
            **vars(options),
            needed_memory=min(memory, options.memory or memory),
            needed_disk=disk,
        )
        item.tries += 1
        if (words := workers.is_too_large(task)) is not None:
            hint = "a machine that has it, or --memory if it needs less"
            self._failed_now(item, Outcome(Reason.TOO_LARGE, "giving it to a worker", words, hint))
            return
        running[source] = item
        workers.submit(task)

    def _ended(self, item: _Item, outcome: Outcome) -> None:
        if outcome.worker:
            self._progress.workers[outcome.worker.partition(":")[0]] += 1
        if outcome.values is None:
            self._failed_now(item, outcome)
            return
        key = outcome.values["run"]
        # The earlier run of the source, if that had other packets.
        before = self._runs.get(self._sources.get(item.recording.source, key))
        before = None if before is None or before["run"] == key else before
        there = self._as_it_is_now(key)
        self._forget(item)
        if there is not None and self._stays(there, item.recording.source):
            self._same_packets(item, there, outcome)
        else:
            # A recording without labels keeps those that it had.
            had = (there or before or {}).get("labels")
            row = {
                **outcome.values,
                "labels": dict(item.recording.labels) or dict(had or ()),
                "seconds": outcome.seconds,
                "tries": item.tries,
                "worker": outcome.worker,
            }
            self._commit(row)
            self._written.add(key)
            if there is not None or before is not None:
                self._progress.replaced += 1
            else:
                self._progress.added += 1
            self._progress.events += row["event_count"] or 0
        if before is not None:
            self._leave(before)
        self._tell()

    def _stays(self, there: Mapping[str, Any], source: str) -> bool:
        """Tell whether a run stays that of another source, which has the same packets."""
        if there["source"] == source:
            return False
        is_meant = self._options.replace and there["run"] not in self._written
        return not is_meant and not _has_changed(there)

    def _leave(self, before: Mapping[str, Any]) -> None:
        """Remove the earlier run of a source with new packets, unless it is of another one now."""
        now = self._as_it_is_now(before["run"])
        if now is not None and now["source"] == before["source"]:
            self._lake.remove([before["run"]])
            self._know(before["run"], None)

    def _same_packets(self, item: _Item, there: Mapping[str, Any], outcome: Outcome) -> None:
        labels = dict(item.recording.labels)
        if not labels or labels == dict(there["labels"] or ()):
            self._progress.same += 1
            return
        hint = "leave out one of the two"
        failed = Outcome(
            reason=Reason.SAME_PACKETS,
            stage="committing",
            error=f"its packets are in the lake already, with other labels, from"
            f" {there['source']} (run {there['run']})",
            hint=hint if self._options.replace else f"{hint}, or give --replace",
            signature=outcome.signature,
            worker=outcome.worker,
        )
        self._failed_now(item, failed)

    def _commit(self, row: Mapping[str, Any]) -> None:
        self._lake.commit([row])
        self._know(row["run"], row)

    def _know(self, key: str, row: Mapping[str, Any] | None) -> None:
        """Remember the row of a run, None if the lake has no such run."""
        known = self._runs.pop(key, None)
        if known is not None and self._sources.get(known["source"]) == key:
            del self._sources[known["source"]]
        if row is not None:
            self._runs[key] = row
            self._sources[row["source"]] = key

    def _forget(self, item: _Item) -> None:
        if self._failed.pop(item.recording.source, None) is not None:
            self._lake.forget_failure(item.recording.source)

    def _failed_now(self, item: _Item, outcome: Outcome) -> None:
        """Try again later if that may help; otherwise write the failure."""
        if outcome.reason in PASSING and item.tries < self._options.tries and item.state:
            self._again.append(item)
            self._progress.retried += 1
            return
        source = item.recording.source
        signature = outcome.signature or (item.state.signature if item.state else None)
        row = {
            "source": source,
            "source_signature": signature,
            "labels": dict(item.recording.labels),
            **{name: getattr(outcome, name) for name in ("reason", "stage", "error", "hint")},
            "tries": item.tries,
            "worker": outcome.worker or None,
        }
        self._lake.write_failure(row)
        self._failed[source] = row
        self._progress.failed += 1
        self._progress.failures.append((source, str(outcome.reason), outcome.error))
        self._tell()

    def _tell(self) -> None:
        self._progress.seconds = time.monotonic() - self._begin
        if self._report is not None:
            self._report(self._progress)


def _has_changed(run: Mapping[str, Any]) -> bool:
    """Tell whether the source of a run is another recording now, or gone."""
    found = _look(Recording(run["source"]))
    if isinstance(found, MsgflowError):
        return isinstance(found, TraceError)
    return bool(found.signature != run["source_signature"])


def _look(recording: Recording) -> State | MsgflowError:
    try:
        return look_at(recording.source)
    except MsgflowError as error:
        return error
    except (OSError, ValueError) as error:
        words = error.strerror if isinstance(error, OSError) and error.strerror else error
        return TraceError(f"cannot be read: {words} — {recording.source!r}", "check the path")
