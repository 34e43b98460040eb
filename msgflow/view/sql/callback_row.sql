-- description: The rows of the timeline that callbacks are on: those of their timer, subscription
--     or service, or their own where that is not known.
-- grain: one row per callback
-- kind: inline
-- column: callback_id BIGINT  The callback
-- column: row_key BIGINT  Row of the timeline, see row.sql
SELECT
    callback_id,
    coalesce(
        CASE kind
            WHEN 'timer' THEN 8 * timer_id
            WHEN 'subscription' THEN 8 * subscription_id + 1
            WHEN 'service' THEN 8 * service_id + 2
        END,
        8 * callback_id + 5
    ) AS row_key
FROM main.callback
