-- name: staging.trace_overlap
-- description: Pairs of traces of one host, of different sessions, that recorded the same kinds of
--     run-time events of the same threads at the same time: everything is in them twice. A session
--     for initialisation beside one for run time is none, as their events differ, nor are the parts
--     of one session.
-- grain: one row per pair of traces
-- needs: staging.source, staging.located
WITH sibling AS (
    SELECT a.trace_index AS first_index, b.trace_index AS second_index
    FROM staging.source AS a
    JOIN staging.source AS b
        ON a.clock_key = b.clock_key
        AND a.hostname = b.hostname
        AND a.trace_index < b.trace_index
        AND a.uuid IS DISTINCT FROM b.uuid
),
event AS (
    SELECT 'callback_start' AS kind, thread_id, trace_index, ts_ns
    FROM staging.located('ros2_callback_start')
    UNION ALL
    SELECT 'rcl_publish', thread_id, trace_index, ts_ns
    FROM staging.located('ros2_rcl_publish')
    UNION ALL
    SELECT 'rmw_take', thread_id, trace_index, ts_ns
    FROM staging.located('ros2_rmw_take')
),
span AS (
    SELECT
        thread_id, kind, trace_index,
        min(ts_ns) AS start_ns, max(ts_ns) AS end_ns, count(*) AS event_count
    FROM event
    WHERE trace_index IN (
        SELECT first_index FROM sibling UNION ALL SELECT second_index FROM sibling
    )
    GROUP BY thread_id, kind, trace_index
)
SELECT
    s.first_index,
    s.second_index,
    sum(least(a.event_count, b.event_count))::BIGINT AS event_count,
    count(DISTINCT a.thread_id) AS thread_count,
    max(least(a.end_ns, b.end_ns)) - min(greatest(a.start_ns, b.start_ns)) AS length_ns
FROM sibling AS s
JOIN span AS a ON s.first_index = a.trace_index
JOIN span AS b
    ON s.second_index = b.trace_index
    AND a.thread_id = b.thread_id
    AND a.kind = b.kind
WHERE least(a.end_ns, b.end_ns) - greatest(a.start_ns, b.start_ns)
    > 0.1 * least(a.end_ns - a.start_ns, b.end_ns - b.start_ns)
GROUP BY s.first_index, s.second_index
