-- description: What has values over time: callbacks, publishers, subscriptions, and programs that
--     use a CPU. Those of one node that look the same are one, so are the lives of a node.
-- grain: one row per object
-- param: runs
-- column: run_id
-- column: owner VARCHAR  'callback', 'publisher', 'subscription' or 'program'
-- column: object_id BIGINT  Its identity: a callback_id, publisher_id or subscription_id, or as in
--     main.program_use
-- column: node VARCHAR [node]  Node that has it; without one its process in brackets; NULL: a
--     program that has none, or several
-- column: subject VARCHAR  What triggers the callback, or the topic, or the program
-- column: process_id
-- column: host_id BIGINT  Machine
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
        c.kind = 'timer' AS is_timer,
        NULL::BIGINT AS host_id
    FROM main.callback AS c
    JOIN main.callback_label AS l ON c.callback_id = l.callback_id
    LEFT JOIN main.subscription AS s ON c.subscription_id = s.subscription_id
    UNION ALL
    SELECT
        e.run_id, e.owner, e.object_id,
        main.node_label(n.full_name, p.name, p.pid),
        e.topic_name, e.process_id, e.topic_name, e.is_internal, false, NULL
    FROM endpoint AS e
    JOIN main.process AS p ON e.process_id = p.process_id
    LEFT JOIN main.node AS n ON e.node_id = n.node_id
    UNION ALL
    SELECT
        u.run_id, 'program', u.program_id,
        CASE WHEN count(DISTINCT n.full_name) = 1 THEN any_value(n.full_name) END,
        u.program, u.process_id, NULL, false, false, u.host_id
    FROM main.program_use(runs) AS u
    LEFT JOIN main.node AS n ON u.process_id = n.process_id
    GROUP BY ALL
)
SELECT
    o.run_id, o.owner, o.object_id, o.node, o.subject, o.process_id,
    coalesce(o.host_id, p.host_id) AS host_id,
    o.topic_name, o.is_internal, o.is_timer,
    CASE
        WHEN o.owner = 'program' THEN o.object_id
        ELSE min(o.object_id) OVER (PARTITION BY o.run_id, o.owner, o.node, o.subject)
    END AS series_id
FROM object AS o
LEFT JOIN main.process AS p ON o.process_id = p.process_id
WHERE list_contains(runs, o.run_id) AND o.subject IS NOT NULL
    AND NOT coalesce(o.is_internal, false)
