-- kind: inline
-- description: Topics with such messages, and whether their flows begin with the stamp of each
--     message, or where its clock may be another one, with its take.
-- grain: one row per topic
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
