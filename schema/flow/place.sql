-- description: The topics and nodes that names or globs, separated by commas, mean. One that fits a
--     topic means topics. Any other one means nodes, as a node is often called like the topic that
--     it publishes.
-- grain: one row per topic, and per node
-- param: names VARCHAR[]  Names or globs: a list, or a text with commas between
CREATE OR REPLACE MACRO derive.place(runs, names) AS TABLE
WITH wanted AS (
    -- A list becomes a text and a list again. Commas part any other text; spaces around are cut.
    SELECT DISTINCT unnest(
        coalesce(
            try_cast(names::VARCHAR AS VARCHAR[]),
            list_transform(string_split(names::VARCHAR, ','), lambda each: trim(each))
        )
    ) AS pattern
),
topic AS MATERIALIZED (
    SELECT DISTINCT w.pattern, p.topic_name
    FROM wanted AS w
    JOIN (
        SELECT run_id, topic_name FROM store.publisher
        UNION
        SELECT run_id, topic_name FROM store.subscription
    ) AS p ON p.topic_name = w.pattern OR p.topic_name GLOB w.pattern
    WHERE list_contains(runs, p.run_id)
)
SELECT DISTINCT
    topic_name,
    NULL::BIGINT AS node_id
FROM topic
UNION ALL
SELECT DISTINCT NULL, n.node_id
FROM wanted AS w
ANTI JOIN topic AS t ON w.pattern = t.pattern
JOIN store.node AS n ON n.full_name = w.pattern OR n.full_name GLOB w.pattern
WHERE list_contains(runs, n.run_id)
