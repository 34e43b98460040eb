-- description: The annotations of a run that a file declared, as an entry of a file has them: what
--     is suggested stands beside them.
-- grain: one row per annotation of a file
WITH input AS (
    SELECT
        i.annotation_id,
        list(DISTINCT s.topic_name ORDER BY s.topic_name) AS topics,
        min(s.node_id) AS node_id
    FROM store.annotation_input AS i
    JOIN store.subscription AS s ON i.subscription_id = s.subscription_id
    GROUP BY i.annotation_id
),
output AS (
    SELECT
        o.annotation_id,
        list(DISTINCT p.topic_name ORDER BY p.topic_name) AS topics,
        min(p.node_id) AS node_id
    FROM store.annotation_output AS o
    JOIN store.publisher AS p ON o.publisher_id = p.publisher_id
    GROUP BY o.annotation_id
),
named AS (
    SELECT
        node_id,
        main.node_name(full_name) AS full_name,
        process_id,
        count(*) OVER (PARTITION BY main.node_name(full_name)) > 1 AS is_name_repeated
    FROM store.node
    WHERE run_id = $run_id
)
SELECT
    a.kind,
    n.full_name AS node,
    i.topics AS inputs,
    o.topics AS outputs,
    CASE WHEN i.node_id <> o.node_id THEN r.full_name END AS inputs_of,
    a.queue_depth, p.pid,
    h.hostname AS host,
    n.is_name_repeated
FROM store.annotation AS a
JOIN input AS i ON a.annotation_id = i.annotation_id
JOIN output AS o ON a.annotation_id = o.annotation_id
JOIN named AS n ON o.node_id = n.node_id
JOIN named AS r ON i.node_id = r.node_id
JOIN store.process AS p ON n.process_id = p.process_id
JOIN store.host AS h ON p.host_id = h.host_id
WHERE a.run_id = $run_id AND a.source = 'file'
ORDER BY n.full_name, h.hostname, p.pid, a.kind, a.annotation_id
