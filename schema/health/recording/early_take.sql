-- title: Messages received before publish() returned
-- description: Messages were received before the call returned that published them, on the same
--     clock. Their latencies are negative.
-- cause: The thread that published was interrupted, or went on to other subscriptions, after it had
--     sent the message.
-- cure: None needed.
-- grain: one row per run
-- severity: info
SELECT
    run_id,
    count(*) AS count,
    printf(
        'messages that were received up to %.3f ms before the call of publish() returned, on the '
        || 'same clock: latency counts from the last event of the call, and is negative for them',
        -min(latency_ns) / 1e6
    ) AS detail
FROM (
    SELECT
        l.run_id,
        derive.corrected_ns(t.taken_ns, c) - derive.corrected_ns(b.end_ns, c) AS latency_ns
    FROM store.link_transport AS l
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    JOIN store.take AS t ON l.take_id = t.take_id
    JOIN derive.process_clock AS c ON b.process_id = c.process_id
    JOIN derive.process_clock AS o ON t.process_id = o.process_id AND c.clock_id = o.clock_id
)
WHERE latency_ns < 0
GROUP BY run_id
