-- description: Topics that messages tell of publishers and subscriptions whose initialisation was
--     not traced.
-- grain: one row per publisher or subscription without a topic of its own
CREATE OR REPLACE MACRO derive.topic_learned(only_run) AS TABLE
SELECT run_id, kind, id, topic_name, is_internal
FROM derive.topic_group(only_run)
WHERE topic_name IS NOT NULL
