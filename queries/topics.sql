-- title: Topics
-- description: The topics of a run: who publishes and subscribes, how many messages were published
--     and how many were handed over. Publishers and subscriptions without a known topic are a
--     row of their own.
-- grain: one row per topic
-- variant: measure VARCHAR {messages|rate|latency|delivery|unmatched|summary} = 'messages'  What
--     is measured: numbers of messages, rates and periods by publisher, the latency from
--     publication to take, what became of the messages, messages and takes without a partner, one
--     by one, or the most important of these by topic
-- column: run_id BIGINT               Run
-- column: topic_name VARCHAR [topic]  Topic
-- column: publisher_count BIGINT      Publishers
-- column: subscription_count BIGINT   Subscriptions
-- column: publication_count BIGINT    Messages published
-- column: take_count BIGINT           Messages handed over to a subscription
-- column: is_internal BOOLEAN         ROS uses it for itself
-- brief: topic_name, publication_count, take_count, publisher_count, subscription_count
WITH publisher_message AS (
    SELECT publisher_id, count(*) AS publication_count
    FROM main.publication
    WHERE list_contains($runs, run_id) AND publisher_id IS NOT NULL
    GROUP BY publisher_id
),

subscription_message AS (
    SELECT subscription_id, count(*) AS take_count
    FROM main.take
    WHERE list_contains($runs, run_id) AND subscription_id IS NOT NULL
    GROUP BY subscription_id
),

endpoint AS (
    SELECT
        publisher.run_id, publisher.topic_name, publisher.is_internal, 1 AS publisher_count,
        0 AS subscription_count,
        coalesce(publisher_message.publication_count, 0) AS publication_count,
        0 AS take_count
    FROM main.publisher
    LEFT JOIN publisher_message ON publisher_message.publisher_id = publisher.publisher_id
    UNION ALL
    SELECT
        subscription.run_id, subscription.topic_name, subscription.is_internal,
        0 AS publisher_count, 1 AS subscription_count, 0 AS publication_count,
        coalesce(subscription_message.take_count, 0) AS take_count
    FROM main.subscription
    LEFT JOIN subscription_message
        ON subscription_message.subscription_id = subscription.subscription_id
)
SELECT
    run_id, topic_name,
    CAST(sum(publisher_count) AS BIGINT) AS publisher_count,
    CAST(sum(subscription_count) AS BIGINT) AS subscription_count,
    CAST(sum(publication_count) AS BIGINT) AS publication_count,
    CAST(sum(take_count) AS BIGINT) AS take_count,
    bool_or(is_internal) AS is_internal
FROM endpoint
WHERE list_contains($runs, run_id)
GROUP BY run_id, topic_name
ORDER BY run_id, topic_name NULLS LAST
