"""Flows as traces of OpenTelemetry: a file of OTLP/JSON, or OTLP/HTTP to a receiver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.export.otlp_batch import BATCH_AS_JSON, BATCH_AS_MESSAGE
from msgflow.export.otlp_receiver import Receiver
from msgflow.files.atomic import replacing
from msgflow.query.names import require_places
from msgflow.sql.statement import internal_sql
from msgflow.version import __version__

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    import duckdb

    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice
    from msgflow.sql.value import Value

_COUNTS = """
SELECT
    coalesce(max(batch) + 1, 0), count(DISTINCT trace_id), count(*),
    coalesce(sum(len(link_span_ids)), 0)::BIGINT
FROM temp.otlp_span
"""


@dataclass(frozen=True)
class ExportedTraces:
    """Traces that were written or sent.

    Attributes:
        run: what they are of.
        traces: number of traces.
        spans: number of spans.
        links: number of links from a span to a further cause.
        rejected: spans that the receiver said it did not keep.
    """

    run: Run
    traces: int
    spans: int
    links: int
    rejected: int = 0


def write_otlp(
    connection: duckdb.DuckDBPyConnection,
    target: Path | str,
    part: Slice,
    choice: Mapping[str, Value] | None = None,
) -> ExportedTraces:
    """Write a run, or some of its flows, as traces of OpenTelemetry, batch by batch.

    Args:
        connection: to a database with the public views.
        target: a file, which is replaced; or the address of a receiver, a text.
        part: one run, and the times to write: everything that begins there, or flows that do.
        choice: which flows, as parameters of `internal.otlp_flow`; everything when None.

    Raises:
        UsageError: not exactly one run, a time that cannot be read, a file that cannot be written,
            a receiver that does not take the traces, or the package opentelemetry-proto is not
            installed.
    """
    run = part.one_run(connection, "traces of OpenTelemetry")
    receiver = Receiver(target) if isinstance(target, str) else None
    try:
        batches, traces, spans, links = _keep_spans(connection, run, part, choice)
        rejected = 0
        if receiver is not None:
            for batch in range(batches):
                rows = _read(connection, BATCH_AS_MESSAGE, run, batch)
                rejected += receiver.send(rows.to_arrow_table().to_pylist())
        elif not isinstance(target, str):
            with replacing(target) as temporary, temporary.open("w", encoding="utf-8") as file:
                for batch in range(batches):
                    ((text,),) = _read(connection, BATCH_AS_JSON, run, batch).fetchall()
                    file.write(f"{text}\n")
    finally:
        connection.execute("DROP TABLE IF EXISTS temp.otlp_span")
    return ExportedTraces(run, traces, spans, links, rejected)


def _keep_spans(
    connection: duckdb.DuckDBPyConnection, run: Run, part: Slice, choice: Mapping[str, Value] | None
) -> tuple[int, int, int, int]:
    """Make the table of spans; return the number of batches, traces, spans and links."""
    of_run = {"runs": [run.run_id], "run_id": run.run_id, **part.window([run]).bindings}
    ((identity,),) = internal_sql().run(connection, "run_identity", of_run).fetchall()
    values = {**of_run, "identity": identity or run.name}
    if choice is not None:
        require_places(connection, [run], choice)
        flows = internal_sql().run(connection, "otlp_flow", {**of_run, **choice})
        values["keys"] = [key for (key,) in flows.fetchall()]
    internal_sql().keep(connection, "otlp_span", values)
    (counts,) = connection.sql(_COUNTS).fetchall()
    return counts


def _read(
    connection: duckdb.DuckDBPyConnection, statement: str, run: Run, batch: int
) -> duckdb.DuckDBPyRelation:
    values = {"run": run.name, "batch": batch, "version": __version__}
    return connection.sql(statement, params=values)
