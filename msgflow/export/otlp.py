"""Flows as traces of OpenTelemetry: a file of OTLP/JSON, a request per line."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

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

_SPANS_AT_ONCE = 2_000


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
    chosen = {**of_run, "run_name": run.name, "identity": identity or run.name}
    if choice is not None:
        places = require_places(connection, [run], choice)
        flows = internal_sql().run(connection, "otlp_flow", {**of_run, **choice, **places})
        chosen["keys"] = [key for (key,) in flows.fetchall()]
    rows = internal_sql().rows(connection, "otlp_span", chosen)
    traces = spans = links = 0
    with replacing(target) as temporary, temporary.open("w", encoding="utf-8") as file:
        while batch := list(islice(rows, _SPANS_AT_ONCE)):
            spans += len(batch)
            traces += sum(not row["span"]["parentSpanId"] for row in batch)
            links += sum(len(row["span"]["links"]) for row in batch)
            file.write(f"{json.dumps(_request(batch), ensure_ascii=False)}\n")
    return ExportedTraces(run, traces, spans, links)


def _request(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    resources: dict[Any, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        identity = {f"msgflow.{row['kind']}_id": row["id"]}
        span = row["span"] | {"attributes": _attributes(row["attributes"] | identity)}
        resources[tuple(row["resource"].items())].append(span)
    scope = {"name": "msgflow", "version": __version__}
    return {
        "resourceSpans": [
            {
                "resource": {"attributes": _attributes(dict(resource))},
                "scopeSpans": [{"scope": scope, "spans": spans}],
            }
            for resource, spans in resources.items()
        ]
    }


def _attributes(values: Mapping[str, str | int | None]) -> list[dict[str, Any]]:
    return [
        {
            "key": name,
            "value": {"stringValue": value} if isinstance(value, str) else {"intValue": str(value)},
        }
        for name, value in values.items()
        if value is not None
    ]
