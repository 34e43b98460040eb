-- description: Values over time: how long callbacks take, and compute; how long messages wait, how
--     many wait, and whether they are lost; the time from one call of a timer, publication or take
--     to the next; the CPU use of programs.
-- grain: one row per value
-- param: runs, series, outcomes
-- column: run_id
-- column: what VARCHAR  'duration', 'CPU time', 'timer', 'topic', 'take', 'wait', 'queue',
--     'loss', 'CPU use' or 'latency'
-- column: series_id
-- column: at_ns BIGINT [epoch ns]  When: at the end of a time from one to the next, else at its
--     begin
-- column: value DOUBLE  Duration in ns; of 'loss' 1 for a message that was lost, else 0; of
--     'queue' messages that wait when one is taken, with itself; of 'CPU use' CPUs
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
    UNION ALL
    SELECT 'take', s.run_id, s.series_id, t.taken_ns, t.is_loss_affected
    FROM main.take AS t
    JOIN query_table(series) AS s ON s.owner = 'subscription' AND t.subscription_id = s.object_id
    WHERE list_contains(runs, t.run_id)
),
message AS MATERIALIZED (
    SELECT
        s.run_id, s.series_id, d.subscription_id, b.start_ns, d.status,
        t.taken_ns - b.end_ns AS wait_ns
    FROM main.stat_delivery AS d
    JOIN main.publication AS b ON d.publication_id = b.publication_id
    JOIN query_table(series) AS s ON s.owner = 'subscription' AND d.subscription_id = s.object_id
    LEFT JOIN main.take AS t ON d.take_id = t.take_id
    WHERE list_contains(runs, d.run_id) AND d.status IN ('delivered', 'lost', 'dropped')
        AND NOT EXISTS (FROM derive.stored_take AS z WHERE z.take_id = d.take_id)
),
queued AS (
    SELECT
        run_id, series_id, start_ns, wait_ns,
        count(*) OVER (
            PARTITION BY subscription_id
            ORDER BY start_ns
            RANGE BETWEEN CURRENT ROW AND greatest(coalesce(wait_ns, 0), 0) FOLLOWING
        ) AS messages
    FROM message
    WHERE status <> 'lost'
        -- Elsewhere each message is taken before the next one comes.
        AND subscription_id IN (
            SELECT subscription_id
            FROM message
            GROUP BY subscription_id
            HAVING max(wait_ns) > (max(start_ns) - min(start_ns)) / count(*)
        )
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
SELECT run_id, 'wait', series_id, start_ns, wait_ns
FROM message
-- Below 0 where clocks are apart.
WHERE wait_ns > 0
UNION ALL
SELECT run_id, 'queue', series_id, start_ns, messages
FROM queued
WHERE wait_ns > 0
UNION ALL
SELECT
    run_id, 'loss', series_id, start_ns,
    (status <> 'delivered')::INTEGER
FROM message
UNION ALL
SELECT run_id, 'CPU use', program_id, at_ns, cpus
FROM main.program_use(runs)
UNION ALL
SELECT run_id, 'latency', alike_id, root_ns, latency_ns
FROM query_table(outcomes)
WHERE is_first AND latency_ns > 0
