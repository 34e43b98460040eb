-- name: finding.early_take
-- title: Messages received before publish() returned
-- description: Messages were received before the call returned that published them, on the same
--     clock. Their latencies are negative.
-- cause: The thread that published was interrupted, or went on to other subscriptions, after it had
--     sent the message.
-- cure: None needed.
-- grain: one row per run
-- severity: info
SELECT
    l.run_id,
    count(*) AS count,
    printf(
        'messages that were received up to %.3f ms before the call of publish() returned, on the '
        || 'same clock: latency counts from the last event of the call, and is negative for them',
        -min(l.latency_ns) / 1e6
    ) AS detail
FROM main.link_transport AS l
JOIN main.publication AS b ON l.publication_id = b.publication_id
JOIN main.process AS bp ON b.process_id = bp.process_id
JOIN main.host AS bh ON bp.host_id = bh.host_id
JOIN main.take AS t ON l.take_id = t.take_id
JOIN main.process AS tp ON t.process_id = tp.process_id
JOIN main.host AS th ON tp.host_id = th.host_id
WHERE l.latency_ns < 0 AND bh.clock_id = th.clock_id
GROUP BY l.run_id
