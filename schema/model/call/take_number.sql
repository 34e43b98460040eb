-- name: staging.take_number
-- description: The number of each take, in the order in which they began, with its subscription and
--     the callback that it led to; of one that is only known by that callback, both are the same.
-- grain: one row per message handed over to a subscription
-- when: staging.take_origin
WITH named AS (
    SELECT
        o.start_event_id, o.callback_start_event_id,
        coalesce(s.subscription_id, i.subscription_id) AS subscription_id
    FROM staging.take_origin AS o
    LEFT JOIN staging.subscription AS s ON o.subscription_event_id = s.event_id
    LEFT JOIN (
        SELECT process_id, rmw_handle, subscription_id
        FROM staging.subscription
        WHERE is_inferred
    ) AS i
        ON o.subscription_event_id IS NULL
        AND o.process_id = i.process_id
        AND o.rmw_handle = i.rmw_handle
)
SELECT
    start_event_id, row_number() OVER (ORDER BY start_event_id) AS take_id, subscription_id,
    callback_start_event_id
FROM named
