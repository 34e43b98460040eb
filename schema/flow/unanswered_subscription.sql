-- description: Subscriptions at which flows seem to end: no take led to a publication, though the
--     node has publishers, all on other topics. Messages without a known take are not looked at.
--     Inputs of annotations are left out, and topics of ROS itself: logging is no effect.
-- grain: one row per such subscription
SELECT s.run_id, s.node_id, s.subscription_id
FROM store.subscription AS s
SEMI JOIN (FROM store.publisher WHERE NOT is_internal) AS o ON s.node_id = o.node_id
ANTI JOIN store.annotation_input AS a ON s.subscription_id = a.subscription_id
ANTI JOIN store.publisher AS p ON s.node_id = p.node_id AND s.topic_name = p.topic_name
-- With an ANTI JOIN, DuckDB would read the links of all runs.
LEFT JOIN (
    SELECT DISTINCT l.run_id, l.subscription_id
    FROM store.link_causal AS l
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    WHERE NOT p.is_internal
) AS l
    ON s.run_id = l.run_id AND s.subscription_id = l.subscription_id
WHERE NOT s.is_internal AND s.topic_name <> '/clock' AND l.subscription_id IS NULL
