-- name: finding.untaken_pair
-- kind: inline
-- description: Publishers and subscriptions between which messages ended for one reason: who they
--     are, in words, how many messages, and when the first of these was published.
-- grain: one row per topic, publishing node, subscribing node and reason
WITH endpoint AS (
    SELECT
        e.kind, e.id,
        printf(
            '%s (%s %d on %s)', coalesce(n.full_name, '?'), coalesce(p.name, '?'), p.pid, h.hostname
        ) AS label
    FROM (
        SELECT 'publisher' AS kind, publisher_id AS id, node_id, process_id FROM store.publisher
        UNION ALL
        SELECT 'subscription', subscription_id, node_id, process_id FROM store.subscription
    ) AS e
    JOIN store.process AS p ON e.process_id = p.process_id
    JOIN store.host AS h ON p.host_id = h.host_id
    LEFT JOIN store.node AS n ON e.node_id = n.node_id
)
SELECT
    u.run_id,
    u.reason,
    printf('%s: %s → %s', s.topic_name, p.label, e.label) AS subject,
    count(*) AS number,
    derive.counted(count(*), 'message')
    || CASE WHEN count(DISTINCT u.subscription_id) > 1
        THEN printf(' to %d subscriptions', count(DISTINCT u.subscription_id)) ELSE '' END
        AS messages,
    min(b.start_ns) AS since_ns
FROM store.undelivered AS u
JOIN main.publication AS b ON u.publication_id = b.publication_id
JOIN store.subscription AS s ON u.subscription_id = s.subscription_id
JOIN endpoint AS p ON p.kind = 'publisher' AND u.publisher_id = p.id
JOIN endpoint AS e ON e.kind = 'subscription' AND u.subscription_id = e.id
WHERE NOT s.is_internal
GROUP BY u.run_id, u.reason, s.topic_name, p.label, e.label
