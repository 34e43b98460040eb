-- description: What has values over time: callbacks, publishers and subscriptions. Those of one
--     node that look the same are one, so are the lives of a node.
-- grain: one row per object
-- param: runs
-- column: run_id
-- column: owner VARCHAR  'callback', 'publisher' or 'subscription'
-- column: object_id BIGINT  Its identity: a callback_id, publisher_id or subscription_id
-- column: node VARCHAR [node]  Node that has it; without one its process in brackets
-- column: subject VARCHAR  What triggers the callback, or the topic
-- column: process_id
-- column: topic_name VARCHAR [topic]  Topic that it publishes or takes; NULL: none
-- column: is_internal
-- column: is_timer BOOLEAN  Whether it is the callback of a timer
-- column: series_id
CREATE OR REPLACE MACRO main.series(runs) AS TABLE
WITH endpoint AS (
    SELECT
        'publisher' AS owner,
        publisher_id AS object_id,
        run_id, process_id, node_id, topic_name, is_internal
    FROM main.publisher
    UNION ALL
    SELECT 'subscription', subscription_id, run_id, process_id, node_id, topic_name, is_internal
    FROM main.subscription
),
object AS (
    SELECT
        c.run_id,
        'callback' AS owner,
        c.callback_id AS object_id,
        l.node,
        l.label AS subject,
        c.process_id, s.topic_name, l.is_internal,
        c.kind = 'timer' AS is_timer
    FROM main.callback AS c
    JOIN main.callback_label AS l ON c.callback_id = l.callback_id
    LEFT JOIN main.subscription AS s ON c.subscription_id = s.subscription_id
    UNION ALL
    SELECT
        e.run_id, e.owner, e.object_id,
        main.node_label(n.full_name, p.name, p.pid),
        e.topic_name, e.process_id, e.topic_name, e.is_internal, false
    FROM endpoint AS e
    JOIN main.process AS p ON e.process_id = p.process_id
    LEFT JOIN main.node AS n ON e.node_id = n.node_id
)
SELECT
    run_id, owner, object_id, node, subject, process_id, topic_name, is_internal, is_timer,
    min(object_id) OVER (PARTITION BY run_id, owner, node, subject) AS series_id
FROM object
WHERE list_contains(runs, run_id) AND subject IS NOT NULL AND NOT coalesce(is_internal, false)
