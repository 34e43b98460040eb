"""What happens in a node with annotations, and a slow reading of what its indirect links are."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, eq=False)
class Run:
    """A run of a callback; times stand for the order of events, which are all apart."""

    subscription: int | None
    thread: int
    start: int
    outer: tuple[Run, ...]
    end: list[int] = field(default_factory=list)

    @property
    def ended(self) -> int:
        return self.end[0]


@dataclass(frozen=True)
class Publication:
    """A publish() call, and the run that made it."""

    publisher: int
    thread: int
    at: int
    run: Run | None


@dataclass
class History:
    """Runs of callbacks, what they publish, and the annotations (kind, inputs, outputs)."""

    runs: list[Run] = field(default_factory=list)
    publications: list[Publication] = field(default_factory=list)
    annotations: list[tuple[str, frozenset[int], frozenset[int]]] = field(default_factory=list)
    # (thread, last event before)
    loss: tuple[int, int] | None = None
    # last event of each thread
    heard: dict[int, int] = field(default_factory=dict)


Link = tuple[int, int, str, int]


def reference(history: History) -> list[Link]:
    """Return (start of the run, publication, kind, candidates) of every indirect link."""
    return sorted(
        link
        for kind, inputs, outputs in history.annotations
        for link in _links(history, kind, inputs, outputs)
    )


def _links(
    history: History, kind: str, inputs: frozenset[int], outputs: frozenset[int]
) -> list[Link]:
    published = [b for b in history.publications if b.publisher in outputs]
    firings = [b for b in published if b.run is not None and b.run.subscription in inputs]
    firing_runs = [b.run for b in firings]
    links = []
    for b in published if kind == "periodic_async" else firings:
        cut = b.at if b.run is None else b.run.start
        read, emptied, kept = b.at, 0, 0
        if kind == "partial_sync":
            first = min(f.at for f in firings if f.run is b.run)
            is_nesting = any(b.run in run.outer for run in history.runs)
            read = b.at if is_nesting else first
            emptied = max((f.at for f in firings if f.run is not b.run and f.at < first), default=0)
            kept = max((f.run.start for f in firings if f.run and f.at < cut), default=0)
        for subscription in inputs:
            if b.run is not None and b.run.subscription == subscription:
                continue
            runs = [
                run
                for run in history.runs
                if run.subscription == subscription
                and (kind == "periodic_async" or run not in firing_runs)
            ]
            there = [run for run in runs if emptied < run.ended <= cut]
            inside = [run for run in runs if b.run in run.outer and run.ended <= read]
            since = max((run.ended, run.start) for run in there)[1] if there else 0
            possible = [
                run
                for run in runs
                if run.start < read
                and run.ended > max(since, kept)
                and not (kind == "partial_sync" and _is_used(run, firings))
            ]
            chosen = inside or there
            if kind == "partial_sync" and not chosen:
                chosen = [run for run in possible if run.ended <= read] or possible
            if not chosen:
                continue
            latest = max(chosen, key=lambda run: run.ended)
            if b.run is not None and latest in b.run.outer:
                continue
            if _is_broken(history, latest.thread, latest.start, b.at) or _is_broken(
                history, b.thread, latest.start, b.at
            ):
                continue
            if kind == "partial_sync" and inside:
                count = len(possible) + 1
            else:
                count = max(len(possible), 1) + (not there)
            links.append((latest.start, b.at, kind, count))
    return links


def _is_used(run: Run, firings: list[Publication]) -> bool:
    """Tell whether a run was nested in a firing, and ended before that published last."""
    return any(b.run in run.outer and run.ended <= b.at for b in firings)


def _is_broken(history: History, thread: int, since: int, until: int) -> bool:
    """Tell whether events of the thread may be missing, as it was heard of again."""
    if history.loss is None or history.loss[0] != thread:
        return False
    return since <= history.loss[1] < until and history.heard[thread] > history.loss[1]
