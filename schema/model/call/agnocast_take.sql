-- description: Messages that Agnocast handed over, to a callback or to a poll. A poll without a
--     message got nothing. `handle` tells subscriptions apart: the number of the callback, or the
--     handle of the subscription that was polled.
-- grain: one row per callable made for a message, or poll that got one
-- when: raw.agnocast_agnocast_create_callable, raw.agnocast_agnocast_take
WITH called AS (
    SELECT
        event_id, ts_ns, trace_index, thread_id, process_id, entry_id,
        pid_callback_info_id AS handle
    FROM staging.located('agnocast_agnocast_create_callable')
),
callback AS (
    SELECT subscription_event_id AS event_id, process_id, callback_handle AS handle
    FROM staging.callback_known
    WHERE kind = 'subscription'
),
polled AS (
    SELECT
        event_id, ts_ns, trace_index, thread_id, process_id, entry_id, subscription_handle AS handle
    FROM staging.located('agnocast_agnocast_take')
    WHERE message <> 0
),
subscription AS (
    SELECT event_id, process_id, subscription_handle AS handle FROM staging.subscription_known
)
SELECT * RENAME (object_event_id AS subscription_event_id)
FROM staging.with_latest('called', 'callback')
UNION ALL
SELECT * FROM staging.with_latest('polled', 'subscription')
