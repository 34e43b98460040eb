-- name: staging.take
-- kind: inline
-- description: Takes, numbered in the order in which they began, with their subscription.
-- grain: one row per message handed over to a subscription
WITH every_take AS NOT MATERIALIZED (
    SELECT
        n.take_id, c.trace_index, n.subscription_id, c.process_id, c.thread_id, c.taken_ns,
        c.source_timestamp_ns, c.method, c.start_event_id, c.end_event_id,
        n.callback_start_event_id
    FROM staging.take_chain AS c
    JOIN staging.take_subscription AS n ON c.start_event_id = n.start_event_id
    UNION ALL
    SELECT
        n.take_id, p.trace_index, n.subscription_id, p.process_id, p.thread_id, p.start_ns,
        NULL, 'callback_only', p.start_event_id, p.start_event_id, p.start_event_id
    FROM staging.callback_pair AS p
    JOIN (
        SELECT * FROM staging.take_subscription WHERE start_event_id = callback_start_event_id
    ) AS n ON p.start_event_id = n.start_event_id
),
elsewhere AS (
    SELECT thread_id, event_id FROM staging.callback_gap WHERE NOT is_between
),
-- With a gap of other CPUs between its events: they may be of two.
interrupted AS (
    SELECT o.start_event_id
    FROM (
        SELECT * FROM every_take WHERE thread_id IN (SELECT thread_id FROM elsewhere)
    ) AS o
    ASOF JOIN elsewhere AS g
        ON o.thread_id = g.thread_id
        AND coalesce(o.callback_start_event_id, o.end_event_id) >= g.event_id
    WHERE g.event_id > o.start_event_id
)
SELECT
    o.take_id,
    o.trace_index + 1 AS trace_id,
    o.subscription_id,
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
    OR (
        o.method = 'callback_only'
        AND o.start_event_id IN (SELECT event_id FROM staging.take_remnant)
    )
        AS is_loss_affected
FROM every_take AS o
LEFT JOIN (SELECT event_id FROM staging.beside_gap WHERE is_behind) AS behind
    ON o.start_event_id = behind.event_id
LEFT JOIN (SELECT event_id FROM staging.beside_gap WHERE NOT is_behind) AS before
    ON o.end_event_id = before.event_id
LEFT JOIN interrupted AS inside ON o.start_event_id = inside.start_event_id
