-- description: Values over time: how long callbacks take, and compute; how long messages wait; the
--     time from one call of a timer or publication to the next; whether messages are lost.
-- grain: one row per value
-- param: runs, series, outcomes
-- column: run_id
-- column: what VARCHAR  'duration', 'CPU time', 'timer', 'topic', 'wait', 'loss' or 'latency'
-- column: series_id
-- column: at_ns BIGINT [epoch ns]  When: at the end of a time from one to the next, else at its
--     begin
-- column: value DOUBLE  Duration in ns; of 'loss' 1 for a message that was lost, else 0
CREATE OR REPLACE MACRO main.series_value(runs, series, outcomes) AS TABLE
WITH run AS NOT MATERIALIZED (
    SELECT s.run_id, s.series_id, s.is_timer, i.start_ns, i.end_ns, i.cpu_ns, i.is_loss_affected
    FROM main.callback_instance AS i
    JOIN query_table(series) AS s ON s.owner = 'callback' AND i.callback_id = s.object_id
    WHERE list_contains(runs, i.run_id)
),
happened AS (
    SELECT
        'timer' AS what,
        run_id, series_id, start_ns, is_loss_affected
    FROM run
    WHERE is_timer
    UNION ALL
    SELECT 'topic', s.run_id, s.series_id, b.start_ns, b.is_loss_affected
    FROM main.publication AS b
    JOIN query_table(series) AS s ON s.owner = 'publisher' AND b.publisher_id = s.object_id
    WHERE list_contains(runs, b.run_id)
)
SELECT
    run_id,
    'duration' AS what,
    series_id,
    start_ns AS at_ns,
    (end_ns - start_ns)::DOUBLE AS value
FROM run
WHERE end_ns IS NOT NULL
UNION ALL
SELECT run_id, 'CPU time', series_id, start_ns, cpu_ns
FROM run
WHERE cpu_ns IS NOT NULL
UNION ALL
SELECT
    run_id, what, series_id, start_ns,
    CASE
        WHEN NOT is_loss_affected
            THEN start_ns - lag(start_ns) OVER (PARTITION BY what, series_id ORDER BY start_ns)
    END
FROM happened
UNION ALL
SELECT s.run_id, 'wait', s.series_id, b.start_ns, l.latency_ns
FROM main.link_transport AS l
JOIN main.take AS t ON l.take_id = t.take_id
JOIN main.publication AS b ON l.publication_id = b.publication_id
JOIN query_table(series) AS s ON s.owner = 'subscription' AND t.subscription_id = s.object_id
-- Below 0 where clocks are apart.
WHERE list_contains(runs, l.run_id) AND l.latency_ns > 0
UNION ALL
SELECT
    s.run_id, 'loss', s.series_id, b.start_ns,
    (d.status <> 'delivered')::INTEGER
FROM main.stat_delivery AS d
JOIN main.publication AS b ON d.publication_id = b.publication_id
JOIN query_table(series) AS s ON s.owner = 'subscription' AND d.subscription_id = s.object_id
WHERE list_contains(runs, d.run_id) AND d.status IN ('delivered', 'lost', 'dropped')
UNION ALL
SELECT run_id, 'latency', alike_id, root_ns, latency_ns
FROM query_table(outcomes)
WHERE is_first AND latency_ns > 0
