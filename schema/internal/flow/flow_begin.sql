-- title: Where a flow begins
-- description: The first publication of a topic, or what a node did first, at or after a time. A
--     topic and a node may have the same name: then it means the topic. There is always a row:
--     without a kind where nothing was done then, without a time where nothing was done at all.
-- grain: one row
-- param: place VARCHAR  Topic or node
-- param: at_ns BIGINT  The time, epoch ns
-- column: kind VARCHAR  'publication' or 'callback_instance'
-- column: id BIGINT  Which one
-- column: last_ns BIGINT [epoch ns]  When the last one began
WITH named AS (
    SELECT
        'publication' AS kind,
        b.publication_id AS id,
        b.start_ns,
        p.topic_name = $place AS is_topic
    FROM main.publication AS b
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    LEFT JOIN main.node AS n ON p.node_id = n.node_id
    WHERE b.run_id = $run_id
        AND (p.topic_name = $place OR n.full_name = $place AND NOT p.is_internal)
    UNION ALL
    SELECT 'callback_instance', i.callback_instance_id, i.start_ns, false
    FROM main.callback_instance AS i
    JOIN main.callback_label AS l ON i.callback_id = l.callback_id
    WHERE i.run_id = $run_id AND l.node = $place AND NOT l.is_internal
),
meant AS (
    SELECT kind, id, start_ns
    FROM named
    WHERE is_topic OR NOT (SELECT bool_or(is_topic) FROM named)
),
found AS (
    SELECT kind, id, start_ns
    FROM meant
    WHERE start_ns >= $at_ns
    UNION ALL
    SELECT NULL, NULL, NULL
)
SELECT
    kind, id,
    (SELECT max(start_ns) FROM meant) AS last_ns
FROM found
ORDER BY start_ns NULLS LAST, kind DESC, id
LIMIT 1
