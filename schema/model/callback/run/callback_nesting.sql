-- description: How deep callback instances are nested on their thread, from 1, and the instance
--     around each. Others may be inside an instance that has a begin or an end of a callback before
--     its own end, and inside one that was never seen to end. The latter lasts, for what is inside
--     it, until the first event of its thread that cannot be inside (`effective_end_event_id`): the
--     next begin or end of a callback, an executor event, or an event behind a gap of any CPU.
--     Where no instance may have others inside, none is nested.
-- grain: one row per callback instance on a thread with one that others may be nested in
-- when: staging.callback_pair_left_over
WITH never_ended AS MATERIALIZED (
    SELECT event_id AS start_event_id, thread_id, previous_executor_event_id
    FROM staging.callback_pair_left_over
    WHERE is_start AND partner_event_id IS NULL
),
closed_by AS (
    SELECT o.start_event_id, min(e.event_id) AS event_id
    FROM never_ended AS o
    JOIN (
        SELECT event_id, thread_id, previous_callback_event_id FROM staging.callback_pair_left_over
        UNION ALL
        SELECT start_event_id, thread_id, previous_callback_event_id
        FROM staging.callback_pair_plain
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
    JOIN staging.executor_first AS x ON o.thread_id = x.thread_id AND x.event_id > o.start_event_id
    UNION ALL
    SELECT o.start_event_id, g.event_id
    FROM never_ended AS o
    ASOF JOIN (SELECT * FROM staging.near_gap WHERE sequence = 'call') AS g
        ON o.thread_id = g.thread_id AND o.start_event_id < g.event_id
),
effective_end AS (
    SELECT start_event_id, min(event_id) AS event_id FROM closed_by GROUP BY start_event_id
),
outer_run AS MATERIALIZED (
    SELECT
        p.event_id AS start_event_id, p.thread_id,
        coalesce(p.partner_event_id, e.event_id, t.last_event_id + 1) AS effective_end_event_id
    FROM staging.callback_pair_left_over AS p
    JOIN staging.thread AS t ON p.thread_id = t.thread_id
    LEFT JOIN effective_end AS e ON p.event_id = e.start_event_id
    WHERE p.is_start
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
nested AS (
    SELECT
        p.start_event_id, p.thread_id, p.end_event_id, p.is_plain,
        coalesce(l.depth, 0) + p.is_plain::INTEGER AS depth
    FROM staging.callback_pair AS p
    ASOF LEFT JOIN level AS l ON p.thread_id = l.thread_id AND p.start_event_id >= l.event_id
    WHERE p.thread_id IN (SELECT thread_id FROM outer_run)
)
SELECT
    i.start_event_id, i.end_event_id, e.effective_end_event_id, i.depth,
    o.start_event_id AS parent_event_id
FROM nested AS i
LEFT JOIN outer_run AS e ON i.start_event_id = e.start_event_id
ASOF LEFT JOIN (SELECT * FROM nested WHERE NOT is_plain) AS o
    ON i.thread_id = o.thread_id AND i.depth - 1 = o.depth AND i.start_event_id > o.start_event_id
