-- name: staging.take_number
-- description: The number of each take, in the order in which they began, with its subscription and
--     the callback that it led to; of one that is only known by that callback, both are the same.
-- grain: one row per message handed over to a subscription
-- needs: staging.take_origin, staging.subscription
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
)
SELECT o.start_event_id, n.take_id, s.subscription_id, o.callback_start_event_id
FROM staging.take_origin AS o
JOIN numbered AS n ON o.start_event_id = n.start_event_id
LEFT JOIN subscription_of AS s ON o.start_event_id = s.start_event_id
