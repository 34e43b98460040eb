"""Flows as traces of OpenTelemetry: a file of OTLP/JSON, a request per line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.query.names import require_places
from msgflow.sql.statement import internal_sql
from msgflow.version import __version__

if TYPE_CHECKING:
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
    """Traces that were written.

    Attributes:
        run: what they are of.
        traces: number of traces.
        spans: number of spans.
        links: number of links from a span to a further cause.
    """

    run: Run
    traces: int
    spans: int
    links: int


def write_otlp(
    connection: duckdb.DuckDBPyConnection,
    target: Path,
    part: Slice,
    choice: Mapping[str, Value] | None = None,
) -> ExportedTraces:
    """Write a run, or the flows of `internal.otlp_flow` that are chosen, batch by batch."""
    if str(target).startswith(("http:/", "https:/")):
        raise UsageError(
            f"traces of OpenTelemetry are written to a file — {target}",
            "a collector sends the file on, with its receiver otlpjsonfile: docs/export.md",
        )
    run = part.one_run(connection, "traces of OpenTelemetry")
    of_run = {"runs": [run.run_id], "run_id": run.run_id, **part.window([run]).bindings}
    ((identity,),) = internal_sql().run(connection, "run_identity", of_run).fetchall()
    chosen = {**of_run, "identity": identity or run.name}
    if choice is not None:
        places = require_places(connection, [run], choice)
        flows = internal_sql().run(connection, "otlp_flow", {**of_run, **choice, **places})
        chosen["keys"] = [key for (key,) in flows.fetchall()]
    try:
        internal_sql().keep(connection, "otlp_span", chosen)
        ((batches, traces, spans, links),) = connection.sql(_COUNTS).fetchall()
        values = {"run_name": run.name, "version": __version__}
        with replacing(target) as temporary, temporary.open("w", encoding="utf-8") as file:
            for batch in range(batches):
                request = {**values, "batch": batch}
                rows = internal_sql().run(connection, "otlp_request", request)
                ((text,),) = rows.fetchall()
                file.write(f"{text}\n")
    finally:
        connection.execute("DROP TABLE IF EXISTS temp.otlp_span")
    return ExportedTraces(run, traces, spans, links)
