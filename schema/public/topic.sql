-- description: Topics, by name: who publishes and subscribes, and how many messages there were.
--     Publishers and subscriptions without a known topic are one row of a run.
-- grain: one row per run and topic
-- column: run_id
-- column: topic_name VARCHAR  Name of the topic; NULL: not known
-- column: is_internal
-- column: publishers VARCHAR[]  Nodes that publish on it, or their processes in brackets
-- column: subscribers VARCHAR[]  Nodes that subscribe to it, likewise
-- column: publisher_count, subscription_count, publication_count, take_count
WITH published AS (
    SELECT
        publisher_id,
        count(*) AS number
    FROM store.publication
    GROUP BY publisher_id
),
taken AS (
    SELECT
        subscription_id,
        count(*) AS number
    FROM store.take
    GROUP BY subscription_id
),
endpoint AS (
    SELECT
        e.run_id, e.topic_name, e.is_internal,
        main.node_label(n.full_name, p.name, p.pid) AS publisher,
        NULL AS subscriber,
        coalesce(m.number, 0) AS publications,
        0 AS takes
    FROM store.publisher AS e
    JOIN store.process AS p ON e.process_id = p.process_id
    LEFT JOIN store.node AS n ON e.node_id = n.node_id
    LEFT JOIN published AS m ON e.publisher_id = m.publisher_id
    UNION ALL
    SELECT
        e.run_id, e.topic_name, e.is_internal, NULL,
        main.node_label(n.full_name, p.name, p.pid),
        0,
        coalesce(m.number, 0)
    FROM store.subscription AS e
    JOIN store.process AS p ON e.process_id = p.process_id
    LEFT JOIN store.node AS n ON e.node_id = n.node_id
    LEFT JOIN taken AS m ON e.subscription_id = m.subscription_id
)
SELECT
    run_id, topic_name,
    bool_or(is_internal) AS is_internal,
    coalesce(list(DISTINCT publisher ORDER BY publisher) FILTER (publisher IS NOT NULL), [])
        AS publishers,
    coalesce(list(DISTINCT subscriber ORDER BY subscriber) FILTER (subscriber IS NOT NULL), [])
        AS subscribers,
    count(publisher) AS publisher_count,
    count(subscriber) AS subscription_count,
    sum(publications)::BIGINT AS publication_count,
    sum(takes)::BIGINT AS take_count
FROM endpoint
GROUP BY run_id, topic_name
