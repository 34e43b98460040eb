-- name: diagnostic.negative_latency
-- title: Messages received before they were published
-- description: Messages between hosts seem to be received before they were published.
-- finding: clocks_apart
-- grain: one row per run
-- severity: warning
-- phase: links
SELECT
    run_id,
    NULL AS trace_id,
    count(*) AS count,
    printf(
        'messages that seem to be received up to %.3f ms before they were published: the clocks '
        || 'of the hosts are apart; msgflow clocks apply %s',
        -min(latency_ns) / 1e6,
        CASE
            WHEN run_id IN (
                SELECT run_id FROM store.diagnostic WHERE name = 'clock_not_synchronised'
            ) THEN 'FILE'
            ELSE 'messages'
        END
    ) AS detail
FROM latency
WHERE latency_ns < 0 AND NOT has_one_clock
GROUP BY run_id
