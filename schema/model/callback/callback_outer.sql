-- name: staging.callback_outer
-- description: Callback instances that others may be nested in: those with anything of a callback
--     before their end, and those never seen to end. The latter last, for what is inside them,
--     until the first event of their thread that cannot be inside: the next begin or end of a
--     callback, executor event, or event behind a gap of any CPU.
-- grain: one row per such callback instance
-- when: staging.callback_left_over
WITH never_ended AS MATERIALIZED (
    SELECT event_id AS start_event_id, thread_id, previous_executor_event_id
    FROM staging.callback_left_over
    WHERE is_start AND partner_event_id IS NULL
),
closed_by AS (
    SELECT o.start_event_id, min(e.event_id) AS event_id
    FROM never_ended AS o
    JOIN (
        SELECT event_id, thread_id, previous_callback_event_id FROM staging.callback_left_over
        UNION ALL
        SELECT start_event_id, thread_id, previous_callback_event_id FROM staging.callback_plain
    ) AS e
        ON o.start_event_id = e.previous_callback_event_id AND o.thread_id = e.thread_id
    GROUP BY o.start_event_id
    UNION ALL
    SELECT o.start_event_id, min(x.event_id)
    FROM never_ended AS o
    JOIN staging.executor_event AS x
        ON o.previous_executor_event_id = x.previous_event_id
        AND o.thread_id = x.thread_id
        AND x.event_id > o.start_event_id
    GROUP BY o.start_event_id
    UNION ALL
    SELECT o.start_event_id, x.event_id
    FROM never_ended AS o
    JOIN staging.executor_first AS x
        ON o.thread_id = x.thread_id AND x.event_id > o.start_event_id
    UNION ALL
    SELECT o.start_event_id, g.event_id
    FROM never_ended AS o
    ASOF JOIN staging.callback_gap AS g
        ON o.thread_id = g.thread_id AND o.start_event_id < g.event_id
),
effective_end AS (
    SELECT start_event_id, min(event_id) AS event_id
    FROM closed_by
    GROUP BY start_event_id
)
SELECT
    p.event_id AS start_event_id,
    p.thread_id,
    p.partner_event_id AS end_event_id,
    coalesce(p.partner_event_id, e.event_id, t.last_event_id + 1) AS effective_end_event_id
FROM staging.callback_left_over AS p
JOIN staging.thread AS t ON p.thread_id = t.thread_id
LEFT JOIN effective_end AS e ON p.event_id = e.start_event_id
WHERE p.is_start
