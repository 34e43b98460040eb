"""Suggestion of requirements: a file that a good run meets, for its author to review."""

from __future__ import annotations

import math
from glob import escape
from typing import TYPE_CHECKING, Any

from msgflow.files.yaml_file import in_quotes
from msgflow.verify.condition import UNITS, Dimension
from msgflow.verify.metrics import SUBJECTS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from msgflow.run.choice import Run

Row = dict[str, Any]
QUERIES = (
    "e2e-latency", "timers", "scheduling", "topics-rate", "topics-delivery",
    "service-latency", "action-latency", "scheduling-wakeup",
)  # fmt: skip
# Of a good run nearly all messages are delivered.
_DELIVERED_PERCENT = 99
# With fewer values, a percentile is only their largest.
LEAST_VALUES = 20
# A topic that pauses or comes in bursts has no rate: the deviation of its period is larger.
_STEADY = 0.25
_RATE_PERCENT = 5
_OF_ACTION = "/_action/"
# The time that an operating system may need to wake a thread.
_LEAST_LATENESS_NS = 1_000_000


def suggest_targets(
    run: Run, results: Mapping[str, Sequence[Row]], margin: float, skipped: float = 0.0
) -> str:
    """Return the text of a file that `read_targets` reads, and that the run meets.

    Comments behind its first line say what speaks against the run. `results` are rows of `QUERIES`,
    by name, without the first `skipped` seconds; `margin` is a share.
    """
    entries = [
        *_paths(results["e2e-latency"], margin),
        *_timers(results["timers"], margin),
        *_callbacks(results["scheduling"], margin),
        *_topics(results["topics-rate"]),
        *_calls(results["service-latency"], "service", "round_trip", "round_trip", margin),
        *_calls(results["action-latency"], "action", "goal", "result", margin),
        *_processes(results["scheduling-wakeup"], margin),
    ]
    warm_up = f"# Without its first {skipped:g} s, a warm-up: verify with --start, too."
    lines = [
        f"# What run {in_quotes(run.name)} met, and {100 * margin:.4g} % more: review it, keep"
        " what matters.",
        *[warm_up] * bool(skipped),
        *_undelivered(results["topics-delivery"]),
        "targets:" if entries else "targets: []",
    ]
    for kind, name, requirements in entries:
        lines.append(f"  - {kind}: {name}")
        lines += [f'    {metric}: "{text}"' for metric, text in requirements.items()]
    return "\n".join(lines)


Entry = tuple[str, str, dict[str, str]]


def _undelivered(rows: Sequence[Row]) -> Iterator[str]:
    for row in rows:
        share = row["delivered_percent"]
        if share is not None and share < _DELIVERED_PERCENT:
            way = in_quotes(f"{row['topic_name']} → {row['subscriber']}")
            yield (
                f"# {way}: only {share:.3g} % of the messages were delivered"
                f" ({row['dropped']} dropped, {row['lost']} lost). Is this a good run?"
            )


def _paths(rows: Sequence[Row], margin: float) -> Iterator[Entry]:
    """Yield a target per first and last topic, which all paths between the two have to meet."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        parts = row["path"].split(" → ")
        # A service that is called has brackets.
        if len(parts) > 4 and parts[1].startswith("/") and parts[-2].startswith("/"):
            groups.setdefault((parts[1], parts[-2]), []).append(row)
    for ends, group in groups.items():
        if ends[0] == ends[1] or any(row["pairs"] < LEAST_VALUES for row in group):
            continue
        slow = max(row["p99_ns"] for row in group)
        share = min(
            row["reached"] / (row["roots"] - row["not_connected"] - row["cut_by_recording"])
            for row in group
        )
        least = math.floor(100 * share * (1 - margin / 10))
        yield (
            "path",
            f"[{', '.join(map(in_quotes, ends))}]",
            {"latency": f"p99 < {_time(slow, margin)}", "completeness": f">= {least} %"},
        )


def _timers(rows: Sequence[Row], margin: float) -> Iterator[Entry]:
    for (node, callback), group in _grouped(rows, "node", "callback"):
        known = [row for row in group if row["count"] >= LEAST_VALUES]
        if not known or len(known) < len(group):
            continue
        requirements = {}
        rates = [row["rate_hz"] for row in known]
        if max(rates) - min(rates) <= 2 * _RATE_PERCENT / 100 * min(rates):
            requirements["rate"] = _around(rates)
        if all(row["lateness_p99_ns"] is not None for row in known):
            late = max(_LEAST_LATENESS_NS, *(row["lateness_p99_ns"] for row in known))
            requirements["lateness"] = f"p99 < {_time(late, margin)}"
        if requirements:
            yield "timer", f"{_quoted(node)}\n    callback: {_quoted(callback)}", requirements


def _callbacks(rows: Sequence[Row], margin: float) -> Iterator[Entry]:
    """Yield a target of the CPU time per callback; there are none without a kernel trace."""
    for (node, callback), group in _grouped(rows, "node", "callback"):
        known = [row for row in group if row["total_ns"]]
        if not node.startswith("/") or any(row["count"] < LEAST_VALUES for row in group):
            continue
        slow = max(row["running_p99_ns"] for row in group)
        lost = max((row["preempted_ns"] / row["total_ns"] for row in known), default=0)
        requirements = {"cpu": f"p99 < {_time(slow, margin)}"}
        most = math.floor(100 * lost * (1 + margin)) + 1
        if most < 100:
            requirements["preempted"] = f"< {most} %"
        yield "callback", f"{_quoted(callback)}\n    node: {_quoted(node)}", requirements


def _processes(rows: Sequence[Row], margin: float) -> Iterator[Entry]:
    """Yield a target per process, which all its threads have to meet: the wait for a CPU."""
    for (nodes, process), group in _grouped(rows, "nodes", "process"):
        # Without nodes it has its id, which is another one in the next run.
        called = nodes if nodes.startswith("/") else process
        if called and any(row["count"] >= LEAST_VALUES for row in group):
            slow = max(row["p99_ns"] for row in group)
            yield "process", _quoted(called), {"wakeup": f"p99 < {_time(slow, margin)}"}


def _topics(rows: Sequence[Row]) -> Iterator[Entry]:
    for (topic, node), group in _grouped(rows, "topic_name", "publisher"):
        if topic is None or not node.startswith("/") or len(group) > 1:
            continue
        row = group[0]
        if row["count"] < LEAST_VALUES or row["period_deviation_ns"] is None:
            continue
        if row["period_deviation_ns"] * row["rate_hz"] <= _STEADY * 1e9:
            rate = {"rate": _around([row["rate_hz"]])}
            yield "topic", f"{_quoted(topic)}\n    node: {_quoted(node)}", rate


def _calls(
    rows: Sequence[Row], kind: str, metric: str, column: str, margin: float
) -> Iterator[Entry]:
    """Yield a target per service or action, which all its clients have to meet."""
    samples = SUBJECTS[kind].metrics[metric].samples
    for (called,), group in _grouped(rows, f"{kind}_name"):
        # The services of an action say no more than the action.
        if called is None or _OF_ACTION in called:
            continue
        if any(row[samples] < LEAST_VALUES for row in group):
            continue
        slow = max(row[f"{column}_p99_ns"] for row in group)
        yield kind, _quoted(called), {metric: f"p99 < {_time(slow, margin)}"}


def _grouped(rows: Sequence[Row], *keys: str) -> list[tuple[tuple[Any, ...], list[Row]]]:
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    return list(groups.items())


def _quoted(name: str) -> str:
    """Return a pattern in quotes that means one name only."""
    return in_quotes(escape(name))


def _around(rates: Sequence[float]) -> str:
    middle = (max(rates) + min(rates)) / 2
    return f"{middle:.4g} Hz ± {_RATE_PERCENT} %"


def _time(duration_ns: int, margin: float) -> str:
    """Return a little more than a duration, rounded up to two digits, with its unit."""
    allowed = max(1.0, duration_ns * (1 + margin)) + 1
    unit, size = max(
        ((unit, size) for unit, size in UNITS[Dimension.TIME].items() if size <= allowed),
        key=lambda item: item[1],
    )
    step = 10 ** (math.floor(math.log10(allowed / size)) - 1)
    return f"{math.ceil(allowed / size / step) * step:.6g} {unit}"
