-- name: staging.callback_run
-- description: Runs of callbacks with their extent and nesting. A run never seen to end lasts, for
--     what is inside it, until the first event of its thread that cannot be inside: the next begin
--     or end of a callback, executor event, or event behind a gap. Runs with nothing of any
--     callback inside them nest nothing, so that only the others make others nested.
-- grain: one row per callback_start
-- needs: staging.callback_event, staging.callback_pair, staging.executor_event,
--     staging.callback_gap, staging.thread
WITH open_run AS (
    SELECT start_event_id, thread_id, previous_executor_event_id
    FROM staging.callback_pair
    WHERE end_event_id IS NULL
),
closed_by AS (
    SELECT o.start_event_id, min(e.event_id) AS event_id
    FROM open_run AS o
    JOIN staging.callback_event AS e
        ON o.start_event_id = e.previous_callback_event_id AND o.thread_id = e.thread_id
    GROUP BY o.start_event_id
    UNION ALL
    SELECT o.start_event_id, min(x.event_id)
    FROM open_run AS o
    JOIN staging.executor_event AS x
        ON o.thread_id = x.thread_id
        AND o.previous_executor_event_id IS NOT DISTINCT FROM x.previous_event_id
        AND x.event_id > o.start_event_id
    GROUP BY o.start_event_id
    UNION ALL
    SELECT o.start_event_id, g.event_id
    FROM open_run AS o
    ASOF JOIN staging.callback_gap AS g
        ON o.thread_id = g.thread_id AND o.start_event_id < g.event_id
),
effective_end AS (
    SELECT start_event_id, min(event_id) AS event_id
    FROM closed_by
    GROUP BY start_event_id
),
outer_run AS (
    SELECT
        p.start_event_id, p.thread_id,
        coalesce(p.end_event_id, e.event_id, t.last_event_id + 1) AS effective_end_event_id
    FROM staging.callback_pair AS p
    JOIN staging.thread AS t ON p.thread_id = t.thread_id
    LEFT JOIN effective_end AS e ON p.start_event_id = e.start_event_id
    WHERE NOT p.is_plain
),
edge AS (
    SELECT thread_id, start_event_id AS event_id, 1 AS step FROM outer_run
    UNION ALL
    SELECT thread_id, effective_end_event_id, -1 FROM outer_run
),
level AS (
    SELECT
        thread_id, event_id,
        (sum(sum(step)) OVER (PARTITION BY thread_id ORDER BY event_id))::INTEGER AS depth
    FROM edge
    GROUP BY thread_id, event_id
),
inside AS (
    SELECT p.start_event_id, l.depth
    FROM staging.callback_pair AS p
    ASOF JOIN level AS l
        ON p.thread_id = l.thread_id AND p.start_event_id >= l.event_id
    WHERE p.is_plain AND p.thread_id IN (SELECT thread_id FROM outer_run)
)
SELECT
    p.start_event_id,
    p.end_event_id,
    coalesce(p.end_event_id, o.effective_end_event_id) AS effective_end_event_id,
    p.start_ns, p.end_ns, p.trace_index, p.thread_id, p.process_id, p.callback_handle,
    p.is_intra_process, p.previous_event_id, p.executor_event_id, p.is_plain,
    CASE WHEN p.is_plain THEN 1 + coalesce(i.depth, 0) ELSE l.depth END AS depth
FROM staging.callback_pair AS p
LEFT JOIN outer_run AS o ON p.start_event_id = o.start_event_id
LEFT JOIN inside AS i ON p.start_event_id = i.start_event_id
LEFT JOIN level AS l ON p.start_event_id = l.event_id AND p.thread_id = l.thread_id
