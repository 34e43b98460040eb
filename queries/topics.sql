-- title: Topics
-- description: The topics of a run: who publishes and subscribes, how many messages were published
--     and how many were handed over. Publishers and subscriptions without a known topic are a
--     row of their own.
-- grain: one row per topic
-- variant: measure VARCHAR {messages|rate|latency|delivery|unmatched|summary} = 'messages'  What
--     is measured: numbers of messages, rates and periods by publisher, the latency from
--     publication to take, what became of the messages, messages and takes without a partner, one
--     by one, or the most important of these by topic
-- column: run_id
-- column: topic_name VARCHAR [topic]  Topic
-- column: publisher_count, subscription_count, publication_count, take_count, is_internal
-- brief: topic_name, publication_count, take_count, publisher_count, subscription_count
SELECT
    run_id, topic_name, publisher_count, subscription_count, publication_count, take_count,
    is_internal
FROM main.topic
WHERE list_contains($runs, run_id)
ORDER BY run_id, topic_name NULLS LAST
