-- title: A node that ended and began again
-- description: What comes meanwhile is lost.
-- grain: one row per node
-- reads: application_path, node_restart
-- next: query topics --measure delivery --topic {topic_name}
SELECT
    0 AS place,
    r.node, p.path, r.topic_name,
    (r.gap_ns / 2 * r.gap_ns / p.length_ns)::BIGINT AS harm_ns,
    r.gap_ns AS p95_ns,
    r.lost, r.published,
    r.gap_ns AS run_ns,
    [r.node] AS claims
FROM node_restart AS r
JOIN application_path AS p ON list_contains(p.steps, r.node)
QUALIFY row_number() OVER (PARTITION BY r.node ORDER BY p.age_ns DESC, p.path) = 1
