-- kind: inline
-- description: Publishers and subscriptions between which messages ended for one reason: who they
--     are, in words and by their ids, and how many messages.
-- grain: one row per topic, publishing node, subscribing node and reason
SELECT
    u.run_id, u.reason, s.topic_name,
    p.node_id AS publishing_node_id,
    s.node_id,
    printf(
        '%s: %s (%s %d) → %s (%s %d)', s.topic_name,
        coalesce(pn.full_name, '?'), coalesce(pp.name, '?'), pp.pid,
        coalesce(sn.full_name, '?'), coalesce(sp.name, '?'), sp.pid
    ) AS subject,
    count(*) AS number,
    list(DISTINCT (u.publisher_id, u.subscription_id)) AS pairs,
    derive.counted(count(*), 'message')
    || CASE WHEN count(DISTINCT u.subscription_id) > 1
        THEN printf(' to %d subscriptions', count(DISTINCT u.subscription_id)) ELSE '' END
        AS messages
FROM store.undelivered AS u
JOIN store.publisher AS p ON u.publisher_id = p.publisher_id
JOIN store.process AS pp ON p.process_id = pp.process_id
LEFT JOIN store.node AS pn ON p.node_id = pn.node_id
JOIN store.subscription AS s ON u.subscription_id = s.subscription_id
JOIN store.process AS sp ON s.process_id = sp.process_id
LEFT JOIN store.node AS sn ON s.node_id = sn.node_id
WHERE NOT s.is_internal
GROUP BY u.run_id, u.reason, s.topic_name, p.node_id, s.node_id, subject
