-- title: Publication rates and periods
-- description: How many messages each publisher published, at what rate, and how regularly. The
--     rate is that of its life, from the first to the last publication in the time window; that of
--     the whole recording is less where it begins late or stops.
-- grain: one row per publisher that published
-- column: run_id, topic_name
-- column: publisher VARCHAR [node]  Node that published
-- column: count BIGINT              Publications in the time window
-- column: rate_hz DOUBLE [Hz]       Publications per second, from the first to the last
-- column: recording_rate_hz
-- column: second_min BIGINT         Publications in the second with the fewest, from the first one
--     to the end of the recording or time window; empty: it is shorter
-- column: silence_max_ns BIGINT [ns]  Longest time without one, from the first one to that end
-- column: period_min_ns BIGINT [ns]     Shortest time from one publication to the next
-- column: period_median_ns BIGINT [ns]  Median time from one publication to the next
-- column: period_p95_ns BIGINT [ns]     95 % of these times are at most this
-- column: period_max_ns BIGINT [ns]     Longest time from one publication to the next
-- column: period_deviation_ns BIGINT [ns]  Standard deviation of these times (jitter)
-- column: publisher_id BIGINT       Identity of the publisher
-- column: is_internal
-- brief: topic_name, publisher, rate_hz, period_median_ns, silence_max_ns, period_deviation_ns,
--     recording_rate_hz, second_min, period_max_ns, count, period_p95_ns, period_min_ns
WITH published AS (
    SELECT
        run_id, publisher_id, start_ns,
        start_ns - lag(start_ns) OVER (
            PARTITION BY publisher_id ORDER BY start_ns, publication_id
        ) AS period_ns
    FROM main.publication
    WHERE list_contains($runs, run_id)
        AND publisher_id IS NOT NULL
        AND start_ns >= $start_ns
        AND start_ns < $end_ns
),
measured AS (
    SELECT
        run_id, publisher_id,
        count(*) AS count,
        (count(*) - 1) * 1e9 / nullif(max(start_ns) - min(start_ns), 0) AS rate_hz,
        min(period_ns) AS period_min_ns,
        quantile_disc(period_ns, [0.5, 0.95]) AS quantiles,
        max(period_ns) AS period_max_ns,
        min(start_ns) AS first_ns,
        max(start_ns) AS last_ns,
        round(stddev_samp(period_ns))::BIGINT AS period_deviation_ns
    FROM published
    GROUP BY run_id, publisher_id
),
ended AS (
    SELECT
        m.publisher_id,
        least(r.end_ns, $end_ns) AS end_ns
    FROM measured AS m
    JOIN main.run AS r ON m.run_id = r.run_id
),
second AS (
    SELECT
        p.publisher_id,
        count(*) AS count
    FROM published AS p
    JOIN measured AS m ON p.publisher_id = m.publisher_id
    JOIN ended AS e ON p.publisher_id = e.publisher_id
    WHERE p.start_ns < m.first_ns + (e.end_ns - m.first_ns) // 1_000_000_000 * 1_000_000_000
    GROUP BY p.publisher_id, (p.start_ns - m.first_ns) // 1_000_000_000
),
fewest AS (
    SELECT
        s.publisher_id,
        CASE
            WHEN count(*) < any_value((e.end_ns - m.first_ns) // 1_000_000_000) THEN 0
            ELSE min(s.count)
        END AS second_min
    FROM second AS s
    JOIN measured AS m ON s.publisher_id = m.publisher_id
    JOIN ended AS e ON s.publisher_id = e.publisher_id
    GROUP BY s.publisher_id
)
SELECT
    m.run_id, b.topic_name,
    main.node_label(n.full_name, p.name, p.pid) AS publisher,
    m.count, m.rate_hz,
    m.count * 1e9 / nullif(least(r.end_ns, $end_ns) - greatest(r.start_ns, $start_ns), 0)
        AS recording_rate_hz,
    f.second_min,
    greatest(m.period_max_ns, e.end_ns - m.last_ns) AS silence_max_ns,
    m.period_min_ns,
    m.quantiles[1] AS period_median_ns,
    m.quantiles[2] AS period_p95_ns,
    m.period_max_ns, m.period_deviation_ns, m.publisher_id, b.is_internal
FROM measured AS m
JOIN main.run AS r ON m.run_id = r.run_id
JOIN ended AS e ON m.publisher_id = e.publisher_id
LEFT JOIN fewest AS f ON m.publisher_id = f.publisher_id
JOIN main.publisher AS b ON m.publisher_id = b.publisher_id
JOIN main.process AS p ON b.process_id = p.process_id
LEFT JOIN main.node AS n ON b.node_id = n.node_id
ORDER BY m.run_id, b.topic_name NULLS LAST, publisher, m.publisher_id
