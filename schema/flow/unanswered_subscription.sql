-- description: Subscriptions at which flows seem to end: less than half of their takes led to a
--     publication, though the node has publishers, all on other topics. Messages without a known
--     take are not looked at. Inputs of annotations are left out, and topics of ROS itself: logging
--     is no effect. What a job may have used of later messages (derive.job_again) counts as none.
-- grain: one row per such subscription
SELECT s.run_id, s.node_id, s.subscription_id
FROM store.subscription AS s
SEMI JOIN (FROM store.publisher WHERE NOT is_internal) AS o ON s.node_id = o.node_id
ANTI JOIN store.annotation_input AS a ON s.subscription_id = a.subscription_id
ANTI JOIN store.publisher AS p ON s.node_id = p.node_id AND s.topic_name = p.topic_name
-- With an ANTI JOIN, DuckDB would read the links of all runs.
LEFT JOIN (
    SELECT
        l.run_id, l.subscription_id,
        count(DISTINCT l.take_id) AS number
    FROM store.link_causal AS l
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    JOIN store.process AS o ON p.process_id = o.process_id
    WHERE NOT p.is_internal
        AND (l.kind = 'direct' AND l.candidate_count > 1 AND NOT o.is_ambiguous) IS NOT TRUE
    GROUP BY l.run_id, l.subscription_id
) AS l
    ON s.run_id = l.run_id AND s.subscription_id = l.subscription_id
LEFT JOIN (
    SELECT
        run_id, subscription_id,
        count(*) AS number
    FROM store.take
    GROUP BY run_id, subscription_id
) AS t
    ON s.run_id = t.run_id AND s.subscription_id = t.subscription_id
WHERE NOT s.is_internal AND s.topic_name <> '/clock' AND coalesce(2 * l.number < t.number, true)
