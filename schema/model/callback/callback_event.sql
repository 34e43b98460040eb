-- name: staging.callback_event
-- description: Begins and ends of callbacks that are not plain, with what comes before them on
--     their thread: directly, of callbacks, and of the executor (not across a gap). `segment`
--     counts the gaps that their thread has seen.
-- grain: one row per such callback_start or callback_end
-- when: raw.ros2_callback_start, raw.ros2_callback_end
WITH event AS (
    SELECT
        s.event_id, s.ts_ns, s.trace_index, s.thread_index, s.callback AS callback_handle,
        true AS is_start, coalesce(s.is_intra_process = 1, false) AS is_intra_process,
        s.previous_call_event_id, s.previous_callback_event_id, s.previous_executor_event_id
    FROM raw.ros2_callback_start AS s
    ANTI JOIN staging.callback_plain AS p ON s.event_id = p.start_event_id
    UNION ALL
    SELECT
        e.event_id, e.ts_ns, e.trace_index, e.thread_index, e.callback, false, false,
        e.previous_call_event_id, e.previous_callback_event_id, NULL
    FROM raw.ros2_callback_end AS e
    ANTI JOIN staging.callback_plain AS p ON e.event_id = p.end_event_id
),
located AS (
    SELECT e.*, c.thread_id, c.process_id
    FROM event AS e
    JOIN staging.context AS c
        ON e.thread_index = c.thread_index
        AND e.event_id >= c.from_event_id
        AND e.event_id < c.until_event_id
)
SELECT
    e.event_id,
    e.ts_ns,
    e.trace_index,
    e.thread_id,
    e.process_id,
    e.callback_handle,
    e.is_start,
    e.is_intra_process,
    CASE WHEN c.event_id IS NULL THEN e.previous_call_event_id END AS previous_event_id,
    e.previous_callback_event_id,
    e.previous_executor_event_id,
    CASE WHEN x.event_id IS NULL THEN e.previous_executor_event_id END AS executor_event_id,
    coalesce(i.segment, 0) AS segment
FROM located AS e
LEFT JOIN staging.callback_segment AS i ON e.event_id = i.event_id
LEFT JOIN (SELECT event_id FROM staging.behind_gap WHERE sequence = 'call') AS c
    ON e.event_id = c.event_id
LEFT JOIN (SELECT event_id FROM staging.behind_gap WHERE sequence = 'executor') AS x
    ON e.event_id = x.event_id
