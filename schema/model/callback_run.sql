-- name: staging.callback_run
-- description: Runs of callbacks with their extent and nesting. A run never seen to end lasts, for
--     what is inside it, until the first event of its thread that cannot be inside: the next
--     callback_start, executor event, or event behind a gap.
-- grain: one row per callback_start
-- needs: staging.callback_event, staging.callback_pair, staging.executor_event,
--     staging.thread_gap, staging.thread
WITH run AS (
    SELECT
        p.start_event_id, p.end_event_id, p.end_ns, e.ts_ns AS start_ns, e.trace_index,
        e.thread_id, e.callback_handle, e.is_intra_process, e.previous_event_id
    FROM staging.callback_pair AS p
    JOIN staging.callback_event AS e ON p.start_event_id = e.event_id
),
open_run AS (
    SELECT start_event_id, thread_id FROM run WHERE end_event_id IS NULL
),
outside AS (
    SELECT thread_id, event_id
    FROM staging.callback_event
    WHERE is_start AND thread_id IN (SELECT thread_id FROM open_run)
    UNION ALL
    SELECT thread_id, event_id
    FROM staging.executor_event
    WHERE thread_id IN (SELECT thread_id FROM open_run)
    UNION ALL
    SELECT thread_id, event_id FROM staging.thread_gap
),
closed_by AS (
    SELECT o.start_event_id, x.event_id
    FROM open_run AS o
    ASOF JOIN outside AS x ON o.thread_id = x.thread_id AND o.start_event_id < x.event_id
),
bounded AS (
    SELECT
        r.start_event_id, r.end_event_id, r.end_ns, r.start_ns, r.trace_index, r.thread_id,
        t.process_id, r.callback_handle, r.is_intra_process, r.previous_event_id,
        coalesce(r.end_event_id, c.event_id, t.last_event_id + 1) AS effective_end_event_id
    FROM run AS r
    JOIN staging.thread AS t ON r.thread_id = t.thread_id
    LEFT JOIN closed_by AS c ON r.start_event_id = c.start_event_id
),
edge AS (
    SELECT thread_id, start_event_id AS event_id, 1 AS step FROM bounded
    UNION ALL
    SELECT thread_id, effective_end_event_id, -1 FROM bounded
),
level AS (
    SELECT
        event_id, step,
        sum(step) OVER (
            PARTITION BY thread_id ORDER BY event_id, step ROWS UNBOUNDED PRECEDING
        ) AS depth
    FROM edge
)
SELECT
    b.start_event_id, b.end_event_id, b.effective_end_event_id, b.start_ns, b.end_ns,
    b.trace_index, b.thread_id, b.process_id, b.callback_handle, b.is_intra_process,
    b.previous_event_id, l.depth::INTEGER AS depth
FROM bounded AS b
JOIN level AS l ON b.start_event_id = l.event_id AND l.step = 1
