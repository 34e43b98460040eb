"""Suggestion of requirements: a file that a good run meets, for its author to review."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from glob import escape
from typing import TYPE_CHECKING

from msgflow.db.sandbox import open_memory
from msgflow.files.yaml_file import in_quotes
from msgflow.sql.statement import internal_sql, registered
from msgflow.verify.metrics import PATH

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.run.choice import Run

QUERIES = (
    "e2e-latency", "timers", "scheduling", "topics-rate", "topics-delivery",
    "service-latency", "action-latency", "scheduling-wakeup",
)  # fmt: skip
# Of a good run nearly all messages are delivered.
_DELIVERED_PERCENT = 99
# With fewer values, a percentile is only their largest.
LEAST_VALUES = 20


def suggest_targets(
    run: Run, results: Mapping[str, pa.Table], margin: float, skipped: float = 0.0
) -> str:
    """Return the text of a file that `read_targets` reads, and that the run meets.

    Comments behind its first line say what speaks against the run. `results` are those of
    `QUERIES`, by name, without the first `skipped` seconds; `margin` is a share.
    """
    tables = {
        name.replace("-", "_"): table.append_column("place", [range(table.num_rows)])
        for name, table in results.items()
    }
    values = {"margin": margin, "least_values": LEAST_VALUES}
    with open_memory() as con, registered(con, **tables):
        targets = list(internal_sql().rows(con, "suggested_target", values))
    warm_up = f"# Without its first {skipped:g} s, a warm-up: verify with --start, too."
    lines = [
        f"# What run {in_quotes(run.name)} met, and {100 * margin:.4g} % more: review it, keep"
        " what matters.",
        *[warm_up] * bool(skipped),
        *_undelivered(results["topics-delivery"]),
        "targets:" if targets else "targets: []",
    ]
    for row in targets:
        if row["kind"] == PATH:
            lines.append(f"  - {PATH}: [{', '.join(map(in_quotes, row['names']))}]")
        else:
            # Patterns that mean one name only.
            name, *others = (in_quotes(escape(each)) for each in row["names"])
            lines += [f"  - {row['kind']}: {name}", *(f"    {row['field']}: {o}" for o in others)]
        required = zip(row["metrics"], row["conditions"], strict=True)
        lines += [f'    {metric}: "{condition}"' for metric, condition in required]
    return "\n".join(lines)


def _undelivered(rows: pa.Table) -> Iterator[str]:
    for row in rows.to_pylist():
        share = row["delivered_percent"]
        if share is not None and share < _DELIVERED_PERCENT:
            way = in_quotes(f"{row['topic_name']} → {row['subscriber']}")
            yield (
                f"# {way}: only {share:.3g} % of the messages were delivered"
                f" ({row['dropped']} dropped, {row['lost']} lost). Is this a good run?"
            )
