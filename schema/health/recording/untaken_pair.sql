-- kind: inline
-- description: Nodes between which messages on a topic ended for one reason: who they are, in words
--     and by the ids of one of each, how many messages, and how many were taken. A node that is
--     destroyed and made again is one.
-- grain: one row per topic, publishing node, subscribing node and reason
WITH pair AS (
    SELECT
        run_id, reason, publisher_id, subscription_id,
        count(*) AS number
    FROM store.undelivered
    GROUP BY run_id, reason, publisher_id, subscription_id
    UNION ALL
    SELECT
        run_id, NULL, publisher_id, subscription_id,
        count(*)
    FROM store.link_transport
    GROUP BY run_id, publisher_id, subscription_id
)
SELECT
    u.run_id, u.reason, s.topic_name,
    min(p.node_id) AS publishing_node_id,
    min(s.node_id) AS node_id,
    printf(
        '%s: %s (%s %d) → %s (%s %d)', s.topic_name,
        coalesce(pn.full_name, '?'), coalesce(pp.name, '?'), pp.pid,
        coalesce(sn.full_name, '?'), coalesce(sp.name, '?'), sp.pid
    ) AS subject,
    sum(u.number)::BIGINT AS number,
    coalesce(
        (sum(sum(u.number)) FILTER (u.reason IS NULL) OVER (PARTITION BY u.run_id, subject)), 0
    )::BIGINT AS taken,
    derive.counted(sum(u.number)::BIGINT, 'message')
    || CASE WHEN count(DISTINCT u.subscription_id) > 1
        THEN printf(' to %d subscriptions', count(DISTINCT u.subscription_id)) ELSE '' END
        AS messages
FROM pair AS u
JOIN store.publisher AS p ON u.publisher_id = p.publisher_id
JOIN store.process AS pp ON p.process_id = pp.process_id
LEFT JOIN store.node AS pn ON p.node_id = pn.node_id
JOIN store.subscription AS s ON u.subscription_id = s.subscription_id
JOIN store.process AS sp ON s.process_id = sp.process_id
LEFT JOIN store.node AS sn ON s.node_id = sn.node_id
WHERE NOT s.is_internal
GROUP BY u.run_id, u.reason, s.topic_name, subject
QUALIFY u.reason IS NOT NULL
