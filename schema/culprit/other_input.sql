-- title: Messages that a filter keeps until further ones come
-- description: A node that needs a message of every input (declared partial_sync or
--     approximate_sync) keeps them for half a period of the path or longer. ApproximateTime hands
--     over a set only when a later message shows that no other one is closer.
-- grain: one row per node, output and path
-- reads: application_path, breakdown, noticed
-- next: links
SELECT
    6 AS place,
    b.node, b.path,
    b.what AS topic_name,
    (b.total_ns / a.reached)::BIGINT AS harm_ns,
    b.p95_ns,
    [b.node || b.what] AS claims
FROM breakdown AS b
JOIN application_path AS a ON b.path = a.path
CROSS JOIN noticed AS l
SEMI JOIN (
    SELECT
        p.topic_name,
        n.full_name AS node
    FROM main.annotation AS d
    JOIN main.annotation_output AS o ON d.annotation_id = o.annotation_id
    JOIN main.publisher AS p ON o.publisher_id = p.publisher_id
    JOIN main.node AS n ON p.node_id = n.node_id
    WHERE d.kind IN ('partial_sync', 'approximate_sync') AND list_contains($runs, d.run_id)
) AS s
    ON b.node = s.node AND b.what = s.topic_name
WHERE b.part = 'cache' AND 2 * b.p95_ns >= a.period_ns
    AND b.p95_ns >= greatest(l.late_ns, l.of_path * a.p95_ns)
