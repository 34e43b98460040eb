-- name: staging.callback_event
-- description: Begins and ends of callbacks, with the number of gaps that their thread has seen.
-- grain: one row per callback_start or callback_end
-- needs: staging.thread_event, staging.thread_gap
WITH numbered AS (
    SELECT
        thread_id, event_id, row_number() OVER (PARTITION BY thread_id ORDER BY event_id) AS segment
    FROM staging.thread_gap
)
SELECT
    e.event_id,
    e.ts_ns,
    e.trace_index,
    e.cpu_id,
    e.thread_id,
    e.handle AS callback_handle,
    e.kind = 'callback_start' AS is_start,
    coalesce(e.value = 1, false) AS is_intra_process,
    CASE WHEN g.event_id IS DISTINCT FROM e.event_id THEN e.previous_event_id END
        AS previous_event_id,
    coalesce(g.segment, 0) AS segment
FROM staging.thread_event AS e
ASOF LEFT JOIN numbered AS g ON e.thread_id = g.thread_id AND e.event_id >= g.event_id
WHERE e.kind IN ('callback_start', 'callback_end')
