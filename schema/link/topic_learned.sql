-- name: derive.topic_learned
-- description: Topics that messages tell of publishers and subscriptions whose initialisation was
--     not traced.
-- grain: one row per publisher or subscription without a topic of its own
-- needs: derive.topic_group
SELECT run_id, kind, id, topic_name, is_internal
FROM derive.topic_group
WHERE topic_name IS NOT NULL
