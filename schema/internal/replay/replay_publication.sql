-- title: Publications to replay
-- description: What was published, by which callback instance, and when the middleware had it
--     (end_ns).
-- grain: one row per publication of a known publisher
WITH cause AS (
    SELECT
        publication_id,
        min(callback_instance_id) AS callback_instance_id
    FROM main.link_causal
    WHERE run_id = $run_id AND kind = 'direct'
    GROUP BY publication_id
)
SELECT b.publication_id, b.publisher_id, b.start_ns, b.end_ns, c.callback_instance_id
FROM main.publication AS b
LEFT JOIN cause AS c ON b.publication_id = c.publication_id
WHERE b.run_id = $run_id AND b.publisher_id IS NOT NULL
ORDER BY b.start_ns, b.publication_id
