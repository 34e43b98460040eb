-- title: A topic has no name
-- description: Its publishers and subscriptions were created before the recording, or their events
--     were lost. Its messages are in flows and paths as ?, and no query can ask for it by name.
-- cause: The session was started after the nodes, or events of initialisation were lost.
-- cure: Name it in a file of links: write the line shown below topics:, with the topic in place of
--     /NAME, then msgflow links apply FILE. msgflow suggest links writes a file with a line for
--     each (docs/links.md).
-- next: suggest links
-- grain: one row per topic
-- severity: warning
-- when: store.publisher WHERE topic_name IS NULL OR is_topic_learned OR is_topic_declared,
--     store.subscription WHERE topic_name IS NULL OR is_topic_learned OR is_topic_declared
SELECT
    run_id, node_id, publishing_node_id,
    CASE WHEN publishers IS NULL THEN 'to ' || subscribers
        WHEN subscribers IS NULL THEN 'from ' || publishers
        ELSE publishers || ' → ' || subscribers END AS subject,
    message_count AS count,
    printf(
        '%s without a topic: - {name: /NAME, %s}', derive.counted(message_count, 'message'), entry
    ) AS detail
FROM main.unnamed_topic($run_id)
