-- title: Latency from publication to take by topic and subscription
-- description: How long messages took from the end of their publication to their take. That
--     includes the time for which the receiving executor was busy with other callbacks, as bounds,
--     as in the query waits; the rest was the network or an idle executor. A negative latency
--     means that the clocks of two hosts are apart. Takes without a known publication are counted,
--     but not measured, and neither are messages that were stored until their subscription existed.
-- grain: one row per topic, receiving node and subscription
-- column: run_id, topic_name
-- column: subscriber VARCHAR [node]  Node that received
-- column: takes BIGINT              Messages received in the time window
-- column: linked BIGINT             Takes whose publication is known
-- column: stored BIGINT             Links left out of the latencies: the message was published
--     before the subscription existed, and stored until then
-- column: ambiguous
-- column: negative BIGINT           Links with negative latency
-- column: min_ns
-- column: median_ns BIGINT [ns]  Median latency
-- column: mean_ns BIGINT [ns]  Mean latency
-- column: busy_mean_min_ns BIGINT [ns]  Part of the mean for which the executor was busy, at least
-- column: busy_mean_max_ns BIGINT [ns]  Part of the mean for which the executor was busy, at most
-- column: p95_ns, p99_ns
-- column: max_ns BIGINT [ns]  Longest latency
-- column: subscription_id, is_internal
-- brief: topic_name, subscriber, median_ns, p99_ns, max_ns, takes, p95_ns, busy_mean_min_ns,
--     busy_mean_max_ns, linked, stored, negative, ambiguous, mean_ns, min_ns
-- note: clocks
WITH received AS (
    SELECT
        t.run_id, t.subscription_id, l.publication_id, l.candidate_count, l.latency_ns, l.stored_ns,
        -- Clocks that are apart may show less than the wait.
        least(coalesce(w.busy_min_ns, 0), greatest(l.latency_ns, 0)) AS busy_min_ns,
        least(coalesce(w.busy_max_ns, l.latency_ns), greatest(l.latency_ns, 0)) AS busy_max_ns
    FROM main.take AS t
    LEFT JOIN main.link_transport AS l ON t.take_id = l.take_id
    LEFT JOIN main.callback_instance AS i ON t.take_id = i.take_id
    LEFT JOIN (FROM main.executor_wait WHERE list_contains($runs, run_id)) AS w
        ON i.callback_instance_id = w.callback_instance_id
    WHERE list_contains($runs, t.run_id)
        AND t.taken_ns >= $start_ns
        AND t.taken_ns < $end_ns
        AND t.method <> 'callback_only'
),
measured AS (
    SELECT
        run_id, subscription_id,
        count(*) AS takes,
        count(publication_id) AS linked,
        count(stored_ns) AS stored,
        count(*) FILTER (WHERE candidate_count > 1) AS ambiguous,
        count(*) FILTER (WHERE latency_ns < 0) AS negative,
        main.spread(latency_ns) AS latency,
        round(avg(busy_min_ns) FILTER (WHERE latency_ns IS NOT NULL))::BIGINT AS busy_mean_min_ns,
        round(avg(greatest(busy_min_ns, busy_max_ns)) FILTER (WHERE latency_ns IS NOT NULL))::BIGINT
            AS busy_mean_max_ns
    FROM received
    GROUP BY run_id, subscription_id
)
SELECT
    m.run_id, s.topic_name,
    main.node_label(n.full_name, p.name, p.pid) AS subscriber,
    m.takes, m.linked, m.stored, m.ambiguous, m.negative, m.latency.min_ns,
    m.latency.median_ns, m.latency.mean_ns, m.busy_mean_min_ns, m.busy_mean_max_ns,
    m.latency.p95_ns, m.latency.p99_ns, m.latency.max_ns, m.subscription_id,
    coalesce(s.is_internal, false) AS is_internal
FROM measured AS m
LEFT JOIN main.subscription AS s ON m.subscription_id = s.subscription_id
LEFT JOIN main.process AS p ON s.process_id = p.process_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
ORDER BY
    m.run_id, m.latency.p99_ns DESC NULLS LAST, s.topic_name NULLS LAST, subscriber,
    m.subscription_id
