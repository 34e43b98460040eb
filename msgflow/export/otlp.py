"""Flows as traces of OpenTelemetry: a file of OTLP/JSON, a request per line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
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


# The spans of a batch, by resource. Attributes are those of the conventions for messaging, remote
# calls, threads and code; what these have no word for begins with 'msgflow.'.
_SPANS_OF_BATCH = """
WITH span AS (
    SELECT
        *,
        [
            {'key': 'service.name', 'text': node, 'number': NULL::BIGINT},
            {'key': 'host.name', 'text': host, 'number': NULL},
            {'key': 'process.pid', 'text': NULL, 'number': pid},
            {'key': 'process.executable.name', 'text': process, 'number': NULL},
            {'key': 'msgflow.run', 'text': $run, 'number': NULL}
        ] AS resource,
        [
            {'key': 'messaging.system', 'number': NULL::BIGINT,
                'text': CASE WHEN operation IS NOT NULL THEN 'ros2' END},
            {'key': 'messaging.destination.name', 'text': topic, 'number': NULL},
            {'key': 'messaging.operation.name', 'number': NULL, 'text': CASE operation
                WHEN 'send' THEN 'publish' WHEN 'receive' THEN 'take' ELSE operation END},
            {'key': 'messaging.operation.type', 'text': operation, 'number': NULL},
            {'key': 'rpc.system.name', 'number': NULL,
                'text': CASE WHEN service IS NOT NULL THEN 'ros2' END},
            {'key': 'rpc.method', 'text': service, 'number': NULL},
            {'key': 'code.function.name', 'text': symbol, 'number': NULL},
            {'key': 'thread.id', 'text': NULL, 'number': tid},
            {'key': 'thread.name', 'text': thread, 'number': NULL},
            {'key': 'msgflow.' || kind || '_id', 'text': NULL, 'number': id},
            {'key': 'msgflow.link', 'text': cause, 'number': NULL},
            {'key': 'msgflow.candidate_count', 'text': NULL, 'number': candidate_count},
            {'key': 'msgflow.latency_ns', 'text': NULL, 'number': latency_ns}
        ] AS attributes,
        coalesce(list_zip(link_trace_ids, link_span_ids, link_causes), []) AS links
    FROM (
        SELECT
            *,
            CASE
                WHEN kind = 'publication' THEN 'send'
                WHEN kind = 'take' THEN 'receive'
                WHEN kind = 'callback_instance' AND topic IS NOT NULL THEN 'process'
            END AS operation
        FROM temp.otlp_span
        WHERE batch = $batch
    )
)
"""
# A value is text or a number. 64-bit integers are text in JSON, ids are hexadecimal.
_ATTRIBUTES = """list_transform(
    list_filter({}, lambda each: each.text IS NOT NULL OR each.number IS NOT NULL),
    lambda each: json_object(
        'key', each.key,
        'value', CASE WHEN each.number IS NULL THEN json_object('stringValue', each.text)
            ELSE json_object('intValue', each.number::VARCHAR) END
    )
)"""
# A request of OTLP/JSON: one row with one text.
_BATCH_AS_JSON = f"""{_SPANS_OF_BATCH},
resource_span AS (
    SELECT json_object(
        'resource', json_object('attributes', {_ATTRIBUTES.format("resource")}),
        'scopeSpans', [json_object(
            'scope', json_object('name', 'msgflow', 'version', $version),
            'spans', list(json_object(
                'traceId', trace_id,
                'spanId', span_id,
                'parentSpanId', coalesce(parent_span_id, ''),
                'name', name,
                'kind', span_kind,
                'startTimeUnixNano', from_ns::VARCHAR,
                'endTimeUnixNano', to_ns::VARCHAR,
                'attributes', {_ATTRIBUTES.format("attributes")},
                'links', list_transform(links, lambda each: json_object(
                    'traceId', each[1],
                    'spanId', each[2],
                    'attributes', [json_object(
                        'key', 'msgflow.link', 'value', json_object('stringValue', each[3])
                    )]
                )),
                'status', CASE WHEN not_delivered IS NULL THEN json_object('code', 0)
                    ELSE json_object('code', 2, 'message', not_delivered) END
            ) ORDER BY from_ns, kind, id)
        )]
    ) AS json
    FROM span
    GROUP BY resource
)
SELECT json_object('resourceSpans', list(json ORDER BY json))::VARCHAR FROM resource_span
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
        values = {"run": run.name, "version": __version__}
        with replacing(target) as temporary, temporary.open("w", encoding="utf-8") as file:
            for batch in range(batches):
                rows = connection.sql(_BATCH_AS_JSON, params={**values, "batch": batch})
                ((text,),) = rows.fetchall()
                file.write(f"{text}\n")
    finally:
        connection.execute("DROP TABLE IF EXISTS temp.otlp_span")
    return ExportedTraces(run, traces, spans, links)
