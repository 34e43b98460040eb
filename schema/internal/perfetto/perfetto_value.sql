-- description: The rate of each publisher, from the time since its publication before; and how many
--     messages of each subscription were published and not yet taken, of those that it took later.
-- grain: one row per value
WITH rate AS (
    SELECT
        publisher_id * 8 + 4 AS track, start_ns AS at_ns,
        1e9 / nullif(start_ns - lag(start_ns) OVER (
            PARTITION BY publisher_id ORDER BY start_ns, publication_id
        ), 0) AS value
    FROM main.publication
    WHERE run_id = $run_id AND start_ns >= $start_ns AND start_ns < $end_ns
        AND publisher_id IS NOT NULL
),
step AS (
    SELECT
        t.subscription_id, unnest([b.end_ns, t.taken_ns]) AS at_ns, unnest([1, -1]) AS step,
        t.take_id
    FROM main.link_transport AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    JOIN main.take AS t ON l.take_id = t.take_id
    WHERE l.run_id = $run_id AND t.subscription_id IS NOT NULL AND t.taken_ns >= b.end_ns
        AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
),
queue AS (
    SELECT
        subscription_id * 8 + 5 AS track, at_ns, take_id,
        sum(step) OVER (
            PARTITION BY subscription_id ORDER BY at_ns, step DESC, take_id
            ROWS UNBOUNDED PRECEDING
        )::DOUBLE AS value,
        row_number() OVER (PARTITION BY subscription_id ORDER BY at_ns, step DESC, take_id) AS place
    FROM step
)
SELECT track, at_ns, value, 0 AS place FROM rate WHERE value IS NOT NULL
UNION ALL
SELECT track, at_ns, value, place FROM queue ORDER BY track, at_ns, place
