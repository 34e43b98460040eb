-- title: Topics at a glance: rate, jitter, drops and latency
-- description: Of each topic, how often and how regularly it was published, what became of its
--     messages, and how long they took to be taken, in the time window. The variants rate, delivery
--     and latency say the same of each publisher and each subscription.
-- grain: one row per topic
-- column: run_id, topic_name, publisher_count, subscription_count, publication_count
-- column: rate_hz DOUBLE [Hz]         Publications of all publishers per second, from the first to
--     the last
-- column: period_median_ns BIGINT [ns]  Median time from one publication of a publisher to its next
-- column: period_deviation_ns BIGINT [ns]  Standard deviation of these times (jitter), of the
--     publisher where it is largest
-- column: delivered BIGINT            Of the messages, counted at each subscription, those taken
-- column: dropped BIGINT              Those that newer ones replaced in a full queue
-- column: lost BIGINT                 Those lost on the way
-- column: not_connected BIGINT        Those while the two were not connected
-- column: cut_by_recording BIGINT     Those that the end of the recording left untaken
-- column: unknown BIGINT              Those with an unknown fate
-- column: reasons MAP(VARCHAR, BIGINT)  Why messages were not taken, and how many
-- column: latency_median_ns BIGINT [ns]  Median latency from publication to take
-- column: latency_p95_ns BIGINT [ns]  95 % of the latencies are at most this
-- column: latency_max_ns BIGINT [ns]  Longest latency
-- column: is_internal
-- brief: topic_name, publication_count, rate_hz, period_deviation_ns, dropped (even 0),
--     lost (even 0), reasons, latency_median_ns, latency_p95_ns, latency_max_ns,
--     delivered (even 0), unknown (even 0)
-- note: clocks
WITH published AS (
    SELECT
        b.run_id, p.topic_name, b.publisher_id, b.start_ns,
        b.start_ns - lag(b.start_ns) OVER (
            PARTITION BY b.publisher_id ORDER BY b.start_ns, b.publication_id
        ) AS period_ns
    FROM main.publication AS b
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE list_contains($runs, b.run_id) AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
),
rate AS (
    SELECT
        run_id, topic_name,
        count(*) AS number,
        (count(*) - 1) * 1e9 / nullif(max(start_ns) - min(start_ns), 0) AS rate_hz,
        quantile_disc(period_ns, 0.5) AS period_median_ns
    FROM published
    GROUP BY run_id, topic_name
),
deviation AS (
    SELECT
        run_id, topic_name,
        round(stddev_samp(period_ns))::BIGINT AS deviation_ns
    FROM published
    GROUP BY run_id, topic_name, publisher_id
),
jitter AS (
    SELECT
        run_id, topic_name,
        max(deviation_ns) AS period_deviation_ns
    FROM deviation
    GROUP BY run_id, topic_name
),
delivery AS (
    SELECT
        s.run_id, s.topic_name,
        histogram(d.status)::MAP(VARCHAR, BIGINT) AS number,
        main.word_counts(d.reason) AS reasons
    FROM main.stat_delivery AS d
    JOIN main.publication AS b ON d.publication_id = b.publication_id
    JOIN main.subscription AS s ON d.subscription_id = s.subscription_id
    WHERE list_contains($runs, d.run_id) AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
    GROUP BY s.run_id, s.topic_name
),
latency AS (
    SELECT
        t.run_id, s.topic_name,
        quantile_disc(l.latency_ns, [0.5, 0.95]) AS quantiles,
        max(l.latency_ns) AS max_ns
    FROM main.take AS t
    JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    JOIN main.link_transport AS l ON t.take_id = l.take_id
    WHERE list_contains($runs, t.run_id)
        AND t.taken_ns >= $start_ns
        AND t.taken_ns < $end_ns
        AND t.method <> 'callback_only'
    GROUP BY t.run_id, s.topic_name
)
SELECT
    t.run_id, t.topic_name, t.publisher_count, t.subscription_count,
    coalesce(r.number, 0) AS publication_count,
    r.rate_hz, r.period_median_ns, j.period_deviation_ns,
    coalesce(d.number['delivered'], 0) AS delivered,
    coalesce(d.number['dropped'], 0) AS dropped,
    coalesce(d.number['lost'], 0) AS lost,
    coalesce(d.number['not_connected'], 0) AS not_connected,
    coalesce(d.number['cut_by_recording'], 0) AS cut_by_recording,
    coalesce(d.number['unknown'], 0) AS unknown,
    d.reasons,
    l.quantiles[1] AS latency_median_ns,
    l.quantiles[2] AS latency_p95_ns,
    l.max_ns AS latency_max_ns,
    t.is_internal
FROM main.topic AS t
LEFT JOIN rate AS r ON t.run_id = r.run_id AND t.topic_name IS NOT DISTINCT FROM r.topic_name
LEFT JOIN jitter AS j ON t.run_id = j.run_id AND t.topic_name IS NOT DISTINCT FROM j.topic_name
LEFT JOIN delivery AS d ON t.run_id = d.run_id AND t.topic_name IS NOT DISTINCT FROM d.topic_name
LEFT JOIN latency AS l ON t.run_id = l.run_id AND t.topic_name IS NOT DISTINCT FROM l.topic_name
WHERE list_contains($runs, t.run_id)
ORDER BY t.run_id, t.topic_name NULLS LAST
