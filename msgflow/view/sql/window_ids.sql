-- description: Bounds of the identities of what a window shows. Identities follow time on the clock
--     of each host, so that links.sql reads little beyond them.
-- grain: one row
-- column: first_take BIGINT  Least identity of a take in the window or after it
-- column: last_take BIGINT  Greatest of a take in the window or before it
-- column: first_publication BIGINT  Least of a publication that ends in the window or after it
-- column: last_publication BIGINT  Greatest of one that begins in the window or before it
-- column: last_instance BIGINT  Greatest of a callback instance that begins in the window or before
SELECT t.first_take, t.last_take, b.first_publication, b.last_publication, i.last_instance
FROM (
    SELECT
        min(take_id) FILTER (WHERE taken_ns >= $start_ns) AS first_take,
        max(take_id) FILTER (WHERE taken_ns < $end_ns) AS last_take
    FROM main.take
    WHERE run_id = $run
) AS t
CROSS JOIN (
    SELECT
        min(publication_id) FILTER (WHERE end_ns >= $start_ns) AS first_publication,
        max(publication_id) FILTER (WHERE start_ns < $end_ns) AS last_publication
    FROM main.publication
    WHERE run_id = $run
) AS b
CROSS JOIN (
    SELECT max(callback_instance_id) AS last_instance
    FROM main.callback_instance
    WHERE run_id = $run AND start_ns < $end_ns
) AS i
ORDER BY ALL
