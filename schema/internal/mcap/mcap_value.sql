-- description: Measured values as messages, in the order of time: latency of paths by the start of
--     the flow (first arrivals), age of the data at their ends by the output, latency from
--     publication to take of topics by the take, duration of callbacks and the time for which
--     executors kept them waiting by their start. A topic has the names of what it measures. If
--     several have them, their identity comes behind; paths of the same nodes and topics are one.
--     Flows that pass a link that may be another one are a series of their own, /ambiguous.
-- grain: one row per value
WITH named_path AS MATERIALIZED (
    SELECT
        path_id, alike_id,
        concat(
            'path', string_split(path, ' → ')[1], '/to', string_split(path, ' → ')[-1],
            CASE WHEN min(alike_id) OVER ends < max(alike_id) OVER ends
                THEN '/' || alike_id ELSE '' END
        ) AS subject
    FROM main.flow_path($runs, only_paths := true)
    WINDOW ends AS (PARTITION BY string_split(path, ' → ')[1], string_split(path, ' → ')[-1])
),
flow AS MATERIALIZED (
    SELECT
        path_id, root_ns, sink_ns, take_id, latency_ns, is_first, is_newest,
        CASE WHEN is_ambiguous THEN '/ambiguous' ELSE '' END AS doubt
    FROM main.end_to_end($runs, paths := 'named_path')
    WHERE status = 'reached' AND latency_ns IS NOT NULL AND (is_first OR is_newest)
),
subscription AS MATERIALIZED (
    SELECT
        s.subscription_id,
        concat(
            'topic', coalesce(s.topic_name, '?'), '/at', coalesce(n.full_name, '?'),
            CASE WHEN count(*) OVER (PARTITION BY s.topic_name, n.full_name) > 1
                THEN '/' || s.subscription_id ELSE '' END
        ) AS subject
    FROM main.subscription AS s
    LEFT JOIN main.node AS n ON s.node_id = n.node_id
    WHERE list_contains($runs, s.run_id) AND NOT coalesce(s.is_internal, false)
),
callback AS MATERIALIZED (
    SELECT
        callback_id,
        concat(
            'callback', node, '/', replace(replace(label, '(/', '/'), ')', ''),
            CASE WHEN count(*) OVER (PARTITION BY node, label) > 1
                THEN '/' || callback_id ELSE '' END
        ) AS subject
    FROM main.callback_label
    WHERE list_contains($runs, run_id) AND NOT is_internal
),
value AS (
    SELECT
        p.subject || f.doubt || '/latency_ms' AS subject,
        f.root_ns AS at_ns,
        f.latency_ns AS value_ns
    FROM flow AS f
    JOIN named_path AS p ON f.path_id = p.path_id
    WHERE f.is_first
    UNION ALL
    SELECT
        p.subject || f.doubt || '/age_ms',
        f.sink_ns,
        f.sink_ns - f.root_ns
    FROM flow AS f
    JOIN named_path AS p ON f.path_id = p.path_id
    WHERE f.is_newest
    UNION ALL
    SELECT
        s.subject || '/latency_ms',
        t.taken_ns, l.latency_ns
    FROM main.link_transport AS l
    JOIN main.take AS t ON l.take_id = t.take_id
    JOIN subscription AS s ON t.subscription_id = s.subscription_id
    WHERE l.latency_ns IS NOT NULL
    UNION ALL
    SELECT
        c.subject || '/duration_ms',
        i.start_ns,
        i.end_ns - i.start_ns
    FROM main.callback_instance AS i
    JOIN callback AS c ON i.callback_id = c.callback_id
    WHERE i.end_ns IS NOT NULL
    UNION ALL
    SELECT
        c.subject || unnest(['/wait_min_ms', '/wait_max_ms']),
        w.start_ns,
        unnest([w.busy_min_ns, w.busy_max_ns])
    FROM main.executor_wait AS w
    JOIN callback AS c ON w.callback_id = c.callback_id
    WHERE w.busy_max_ns IS NOT NULL
)
SELECT
    '/msgflow/' || regexp_replace(subject, '[^A-Za-z0-9_/]+', '_', 'g') AS topic,
    at_ns,
    value_ns / 1e6::DOUBLE AS value_ms
FROM value
WHERE at_ns >= $start_ns AND at_ns < $end_ns AND value_ns IS NOT NULL
ORDER BY at_ns, topic, value_ms
