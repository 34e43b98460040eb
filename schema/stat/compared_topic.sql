-- name: derive.compared_topic
-- kind: macro
-- description: Transport latencies by topic and receiving node, which are the same in other runs of
--     a system.
-- grain: one row per take
-- param: runs BIGINT[]  Runs to look at
-- needs: main.take, main.link_transport, main.subscription, main.node, main.process,
--     derive.node_label
CREATE OR REPLACE MACRO derive.compared_topic(runs) AS TABLE
SELECT
    t.run_id,
    coalesce(s.topic_name, '?') || ' → ' || derive.node_label(n.full_name, p.name, p.pid)
        AS subject,
    coalesce(s.is_internal, false) AS is_internal,
    t.taken_ns AS at_ns,
    t.take_id AS id,
    l.latency_ns AS value_ns,
    true AS is_unit,
    l.take_id IS NOT NULL AS is_complete
FROM main.take AS t
LEFT JOIN main.link_transport AS l ON t.take_id = l.take_id
LEFT JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
LEFT JOIN main.process AS p ON s.process_id = p.process_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
WHERE list_contains(runs, t.run_id) AND t.method <> 'callback_only'
