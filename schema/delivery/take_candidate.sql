-- description: Publications that a take without a link could come from: its stamp fits them, but
--     none of them could be chosen.
-- grain: one row per take without a link and publication
CREATE OR REPLACE MACRO derive.take_candidate(only_run) AS TABLE
WITH orphan AS (
    SELECT t.run_id, t.take_id, t.source_timestamp_ns, s.topic_name
    FROM store.take AS t
    ANTI JOIN store.link_transport AS l ON t.take_id = l.take_id
    LEFT JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
    WHERE t.run_id = only_run AND t.source_timestamp_ns <> 0
)
SELECT o.run_id, o.take_id, b.publication_id
FROM orphan AS o
JOIN store.publication AS b ON o.run_id = b.run_id AND o.source_timestamp_ns = b.source_timestamp_ns
LEFT JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
WHERE b.run_id = only_run AND coalesce(o.topic_name = p.topic_name, true)
