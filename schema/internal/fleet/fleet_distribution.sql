-- description: Counts of durations and latencies in buckets whose limits grow by 2 %. Of several
--     runs the counts of a bucket are added; a quantile of the sum is off by less than 1 % of its
--     value. Bucket b > 0 holds times above 1.02^(b-2) ns up to 1.02^(b-1) ns, for which
--     2 / 2.02 * 1.02^(b-1) ns stands; bucket 0 holds zero, -b the times below zero.
-- grain: one row per measure, node, callback or topic, and bucket
WITH instance AS (
    SELECT
        run_id, callback_id,
        end_ns - start_ns AS duration_ns,
        start_ns - lag(start_ns) OVER (
            PARTITION BY callback_id ORDER BY start_ns, callback_instance_id
        ) AS period_ns
    FROM main.callback_instance
    WHERE list_contains($runs, run_id)
),
of_callback AS (
    SELECT
        run_id,
        'callback_duration' AS measure,
        callback_id,
        duration_ns AS time_ns
    FROM instance
    UNION ALL
    SELECT run_id, 'callback_period', callback_id, period_ns
    FROM instance
    UNION ALL
    SELECT run_id, 'callback_wait', callback_id, wait_ns
    FROM main.executor_wait
    WHERE list_contains($runs, run_id)
),
measured AS (
    SELECT
        m.run_id, m.measure, l.node,
        l.label AS subject,
        l.is_internal, m.time_ns
    FROM of_callback AS m
    JOIN main.callback_label AS l ON m.callback_id = l.callback_id
    UNION ALL
    SELECT
        t.run_id,
        'transport_latency',
        main.node_label(n.full_name, p.name, p.pid),
        s.topic_name,
        coalesce(s.is_internal, false),
        k.latency_ns
    FROM main.take AS t
    JOIN main.link_transport AS k ON t.take_id = k.take_id
    LEFT JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    LEFT JOIN main.process AS p ON s.process_id = p.process_id
    LEFT JOIN main.node AS n ON s.node_id = n.node_id
    WHERE list_contains($runs, t.run_id) AND t.method <> 'callback_only'
)
SELECT
    run_id, measure, node, subject, is_internal,
    CASE
        WHEN time_ns = 0 THEN 0
        ELSE sign(time_ns) * (1 + ceil(ln(abs(time_ns)) / ln(1.02)))::BIGINT
    END AS bucket,
    count(*) AS count
FROM measured
WHERE time_ns IS NOT NULL
GROUP BY ALL
ORDER BY run_id, measure, node, subject, is_internal, bucket
