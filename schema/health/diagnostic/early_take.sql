-- name: diagnostic.early_take
-- title: Messages received before publish() returned
-- description: Messages were received before the call returned that published them, on the same
--     clock. Their latencies are negative.
-- cause: The thread that published was interrupted, or went on to other subscriptions, after it had
--     sent the message.
-- cure: None needed.
-- grain: one row per run
-- severity: info
-- phase: links
SELECT
    run_id,
    NULL AS trace_id,
    count(*) AS count,
    printf(
        'messages that were received up to %.3f ms before the call of publish() returned, on the '
        || 'same clock: latency counts from the last event of the call, and is negative for them',
        -min(latency_ns) / 1e6
    ) AS detail
FROM latency
WHERE latency_ns < 0 AND has_one_clock
GROUP BY run_id
