-- name: staging.take
-- description: Takes, numbered in the order in which they began, with their subscription.
-- grain: one row per message handed over to a subscription
-- needs: staging.take_origin, staging.subscription, staging.beside_gap, staging.callback_gap,
--     staging.predecessor, raw
WITH subscription_of AS (
    SELECT o.start_event_id, s.subscription_id
    FROM staging.take_origin AS o
    JOIN staging.subscription AS s ON o.subscription_event_id = s.event_id
    UNION ALL
    SELECT o.start_event_id, s.subscription_id
    FROM staging.take_origin AS o
    JOIN staging.subscription AS s
        ON o.process_id = s.process_id AND o.rmw_handle = s.rmw_handle
    WHERE o.subscription_event_id IS NULL AND s.is_inferred
),
-- Apart, since what is sorted should be narrow.
numbered AS (
    SELECT start_event_id, row_number() OVER (ORDER BY start_event_id) AS take_id
    FROM staging.take_origin
),
elsewhere AS (
    SELECT thread_id, event_id FROM staging.callback_gap WHERE NOT is_between
),
-- With a gap of other CPUs between its events: they may be of two.
interrupted AS (
    SELECT o.start_event_id
    FROM (
        SELECT * FROM staging.take_origin WHERE thread_id IN (SELECT thread_id FROM elsewhere)
    ) AS o
    ASOF JOIN elsewhere AS g
        ON o.thread_id = g.thread_id
        AND coalesce(o.callback_start_event_id, o.end_event_id) >= g.event_id
    WHERE g.event_id > o.start_event_id
),
-- Callbacks right behind the last layer of a take whose others are in a gap.
remnant AS (
    SELECT p.event_id
    FROM staging.predecessor AS p
    JOIN staging.beside_gap AS g ON p.previous_event_id = g.event_id AND g.is_behind
    JOIN raw.ros2_rclcpp_take AS u ON p.previous_event_id = u.event_id
    WHERE p.sequence = 'call'
)
SELECT
    n.take_id,
    o.trace_index + 1 AS trace_id,
    s.subscription_id,
    o.process_id,
    o.thread_id,
    o.taken_ns,
    o.source_timestamp_ns,
    o.method,
    o.start_event_id,
    o.end_event_id,
    o.callback_start_event_id,
    behind.event_id IS NOT NULL
    OR before.event_id IS NOT NULL
    OR inside.start_event_id IS NOT NULL
    OR (o.method = 'callback_only' AND o.start_event_id IN (SELECT event_id FROM remnant))
        AS is_loss_affected
FROM staging.take_origin AS o
JOIN numbered AS n ON o.start_event_id = n.start_event_id
LEFT JOIN subscription_of AS s ON o.start_event_id = s.start_event_id
LEFT JOIN (SELECT event_id FROM staging.beside_gap WHERE is_behind) AS behind
    ON o.start_event_id = behind.event_id
LEFT JOIN (SELECT event_id FROM staging.beside_gap WHERE NOT is_behind) AS before
    ON o.end_event_id = before.event_id
LEFT JOIN interrupted AS inside ON o.start_event_id = inside.start_event_id
