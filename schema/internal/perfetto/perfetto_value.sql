-- description: The rate of each publisher, from the time since its publication before; and how many
--     messages of each subscription were published and not yet taken, of those that it took later.
-- grain: one row per value
WITH rate AS (
    SELECT
        publisher_id,
        start_ns AS at_ns,
        1e9 / nullif(start_ns - lag(start_ns) OVER (
            PARTITION BY publisher_id ORDER BY start_ns, publication_id
        ), 0) AS value
    FROM main.publication
    WHERE run_id = $run_id AND start_ns >= $start_ns AND start_ns < $end_ns
),
step AS (
    SELECT
        t.subscription_id, t.take_id,
        unnest([b.end_ns, t.taken_ns]) AS at_ns,
        unnest([1, -1]) AS step
    FROM main.link_transport AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    JOIN main.take AS t ON l.take_id = t.take_id
    WHERE l.run_id = $run_id AND t.taken_ns >= b.end_ns
        AND b.start_ns >= $start_ns AND b.start_ns < $end_ns
),
queue AS (
    SELECT
        subscription_id, at_ns,
        sum(step) OVER so_far::DOUBLE AS value,
        row_number() OVER so_far AS place
    FROM step
    WINDOW so_far AS (
        PARTITION BY subscription_id ORDER BY at_ns, step DESC, take_id ROWS UNBOUNDED PRECEDING
    )
)
SELECT
    'rate' AS kind,
    p.publisher_id AS id,
    p.process_id,
    'rate of ' || coalesce(p.topic_name, '?') AS name,
    'Hz' AS unit,
    r.at_ns, r.value, 0 AS place
FROM rate AS r
JOIN main.publisher AS p ON r.publisher_id = p.publisher_id
WHERE r.value IS NOT NULL
UNION ALL
SELECT
    'queue', s.subscription_id, s.process_id,
    'not yet taken of ' || coalesce(s.topic_name, '?'),
    'messages',
    q.at_ns, q.value, q.place
FROM queue AS q
JOIN main.subscription AS s ON q.subscription_id = s.subscription_id
ORDER BY kind, id, at_ns, place
