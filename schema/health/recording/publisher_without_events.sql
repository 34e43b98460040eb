-- title: A publisher whose publications are not traced
-- description: Messages of a topic were taken whose publication is not in the traces. A publisher
--     of the topic was recorded, but not one publication of it. Flows of these messages begin at
--     the take, and topics --measure rate does not know them.
-- cause: Serialized messages, as the player of a bag (ros2 bag play) and bridges publish them, have
--     no event before Jazzy. Or a publisher that is not traced sends on the topic, too.
-- cure: None needed to follow messages from the take on. For the publications, record with Jazzy or
--     later, and trace every host.
-- grain: one row per topic
-- severity: warning
-- when: store.orphan_take WHERE reason = 'publisher_without_events'
WITH silent AS (
    SELECT
        b.run_id, b.topic_name,
        derive.names_in_words(
            printf(
                '%s (%s %d on %s)', coalesce(n.full_name, '?'), coalesce(p.name, '?'), p.pid,
                h.hostname
            )
        ) AS labels
    FROM store.publisher AS b
    ANTI JOIN store.publication AS u ON b.publisher_id = u.publisher_id
    JOIN store.process AS p ON b.process_id = p.process_id
    JOIN store.host AS h ON p.host_id = h.host_id
    LEFT JOIN store.node AS n ON b.node_id = n.node_id
    GROUP BY b.run_id, b.topic_name
)
SELECT
    o.run_id, s.topic_name,
    count(*) AS count,
    printf('%s, and no publication of %s', derive.counted(count(*), 'message'), l.labels) AS detail
FROM store.orphan_take AS o
JOIN store.subscription AS s ON o.subscription_id = s.subscription_id
JOIN silent AS l ON s.run_id = l.run_id AND s.topic_name = l.topic_name
WHERE o.reason = 'publisher_without_events' AND NOT coalesce(s.is_internal, false)
GROUP BY o.run_id, s.topic_name, l.labels
