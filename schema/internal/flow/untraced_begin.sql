-- title: Where flows of publishers that are not traced begin
-- description: Topics with such messages, and whether their flows begin with the stamp of each
--     message, or where its clock may be another one, with its take.
-- grain: one row per topic
-- column: topic_name VARCHAR [topic]  Topic
-- column: is_stamped BOOLEAN  Flows begin with the stamp; NULL: some do
SELECT
    s.topic_name,
    CASE
        WHEN bool_or(r.before_take_ns <> 0) = bool_and(r.before_take_ns <> 0)
            THEN bool_or(r.before_take_ns <> 0)
    END AS is_stamped
FROM store.flow_root AS r
JOIN store.subscription AS s ON r.publisher_id = -s.subscription_id
WHERE r.root_kind = 'take' AND list_contains($runs, r.run_id)
GROUP BY s.topic_name
ORDER BY s.topic_name
