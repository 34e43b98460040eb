-- name: staging.callback_depth
-- description: How deep callback instances are nested on their thread, from 1, and the instance
--     that each is nested in. Where none can have others inside, none is nested.
-- grain: one row per callback instance on a thread with one that others may be nested in
-- when: staging.callback_outer
WITH edge AS (
    SELECT thread_id, start_event_id AS event_id, 1 AS step FROM staging.callback_outer
    UNION ALL
    SELECT thread_id, effective_end_event_id, -1 FROM staging.callback_outer
),
level AS (
    SELECT
        thread_id, event_id,
        (sum(sum(step)) OVER (PARTITION BY thread_id ORDER BY event_id))::INTEGER AS depth
    FROM edge
    GROUP BY thread_id, event_id
),
nested AS (
    SELECT
        p.start_event_id, p.thread_id, p.is_plain,
        coalesce(l.depth, 0) + p.is_plain::INTEGER AS depth
    FROM staging.callback_pair AS p
    ASOF LEFT JOIN level AS l ON p.thread_id = l.thread_id AND p.start_event_id >= l.event_id
    WHERE p.thread_id IN (SELECT thread_id FROM staging.callback_outer)
)
SELECT i.start_event_id, i.depth, o.start_event_id AS parent_event_id
FROM nested AS i
ASOF LEFT JOIN (SELECT * FROM nested WHERE NOT is_plain) AS o
    ON i.thread_id = o.thread_id
    AND i.depth - 1 = o.depth
    AND i.start_event_id > o.start_event_id
