-- description: Topics that report on nodes, and carry no data of the application. Of some the name
--     tells that: the clock, diagnostics, status and feedback of actions. On others each node
--     publishes at most twice a second, nothing leads to them, and nothing follows from them; and
--     several nodes publish on them, or one with faster outputs, and no node takes them that
--     publishes itself.
-- grain: one row per run and such topic
-- param: runs
CREATE OR REPLACE MACRO derive.heartbeat_topic(runs) AS TABLE
WITH publisher AS MATERIALIZED (
    SELECT
        p.run_id, p.publisher_id, p.topic_name, p.node_id, n.full_name,
        regexp_full_match(
            p.topic_name, '/clock|.*/diagnostics(_agg)?|.*/_action/(status|feedback)'
        ) AS is_named,
        count(b.publication_id) <= 1 + 2e-9 * any_value(r.end_ns - r.start_ns) AS is_slow
    FROM store.publisher AS p
    JOIN store.run AS r ON p.run_id = r.run_id
    LEFT JOIN store.node AS n ON p.node_id = n.node_id
    LEFT JOIN store.publication AS b ON p.publisher_id = b.publisher_id
    WHERE list_contains(runs, p.run_id) AND NOT p.is_internal AND p.topic_name IS NOT NULL
    GROUP BY p.run_id, p.publisher_id, p.topic_name, p.node_id, n.full_name
),
depending AS (
    SELECT h.run_id, h.publisher_id, s.topic_name
    FROM store.flow_hop AS h
    JOIN store.subscription AS s ON h.from_subscription_id = s.subscription_id
    WHERE list_contains(runs, h.run_id) AND s.topic_name IS NOT NULL
)
SELECT run_id, topic_name
FROM publisher
GROUP BY run_id, topic_name
HAVING bool_and(is_named)
    OR bool_and(is_slow AND publisher_id NOT IN (SELECT publisher_id FROM depending))
    AND (run_id, topic_name) NOT IN (SELECT (run_id, topic_name) FROM depending)
    AND (
        count(DISTINCT full_name) > 1
        OR bool_or(node_id IN (SELECT node_id FROM publisher WHERE NOT is_slow AND NOT is_named))
        AND (run_id, topic_name) NOT IN (
            SELECT (s.run_id, s.topic_name)
            FROM store.subscription AS s
            JOIN publisher AS p ON s.node_id = p.node_id
            WHERE list_contains(runs, s.run_id) AND NOT p.is_named AND s.topic_name IS NOT NULL
        )
    )
