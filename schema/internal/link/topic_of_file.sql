-- description: What a file named for a run, and topics that still have no name, as entries of a
--     file have them: both stand in the file of suggestions.
-- grain: one row per named publisher or subscription, and per unnamed topic
SELECT
    topic_name AS name,
    entry,
    NULL AS publishers,
    NULL AS subscribers,
    NULL AS message_count
FROM derive.unnamed_endpoint($run_id)
WHERE is_topic_declared
UNION ALL
SELECT NULL, entry, publishers, subscribers, message_count FROM main.unnamed_topic($run_id)
ORDER BY name NULLS LAST, message_count DESC NULLS LAST, entry
