-- description: The spans of a batch, by resource, as one text: 64-bit integers are text in it, ids
--     are hexadecimal. Attributes are those of the conventions for messaging, remote calls, threads
--     and code; what these have no word for begins with 'msgflow.'.
-- grain: one row
-- param: batch BIGINT  Number of the request
-- param: run_name VARCHAR  Name of the run
-- param: version VARCHAR  Version of msgflow
WITH span AS (
    SELECT
        *,
        CASE
            WHEN kind = 'publication' THEN 'send'
            WHEN kind = 'take' THEN 'receive'
            WHEN kind = 'callback_instance' AND topic IS NOT NULL THEN 'process'
        END AS operation
    FROM temp.otlp_span
    WHERE batch = $batch
),
-- Attributes of the resource, and of the span. A value is text or a number.
attributed AS (
    SELECT
        *,
        [
            [
                {'key': 'service.name', 'text': node, 'number': NULL::BIGINT},
                {'key': 'host.name', 'text': host, 'number': NULL},
                {'key': 'process.pid', 'text': NULL, 'number': pid},
                {'key': 'process.executable.name', 'text': process, 'number': NULL},
                {'key': 'msgflow.run', 'text': $run_name, 'number': NULL}
            ],
            [
                {'key': 'messaging.system', 'number': NULL,
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
            ]
        ] AS attributes
    FROM span
),
written AS (
    SELECT * REPLACE (
        list_transform(attributes, lambda those: list_transform(
            list_filter(those, lambda each: each.text IS NOT NULL OR each.number IS NOT NULL),
            lambda each: json_object('key', each.key, 'value', CASE
                WHEN each.number IS NULL THEN json_object('stringValue', each.text)
                ELSE json_object('intValue', each.number::VARCHAR)
            END)
        )) AS attributes
    )
    FROM attributed
),
resource_span AS (
    SELECT json_object(
        'resource', json_object('attributes', attributes[1]),
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
                'attributes', attributes[2],
                'links', list_transform(
                    coalesce(list_zip(link_trace_ids, link_span_ids, link_causes), []),
                    lambda each: json_object(
                        'traceId', each[1],
                        'spanId', each[2],
                        'attributes', [json_object(
                            'key', 'msgflow.link', 'value', json_object('stringValue', each[3])
                        )]
                    )
                ),
                'status', CASE WHEN not_delivered IS NULL THEN json_object('code', 0)
                    ELSE json_object('code', 2, 'message', not_delivered) END
            ) ORDER BY from_ns, kind, id)
        )]
    ) AS json
    FROM written
    GROUP BY attributes[1]
)
SELECT json_object('resourceSpans', list(json ORDER BY json))::VARCHAR AS json
FROM resource_span
