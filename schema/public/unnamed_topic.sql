-- description: Topics that have no name: neither the trace nor a file of links gives one to any of
--     the publishers and subscriptions that messages join. One of them stands for all in an entry
--     of the file: a publisher, where there is one.
-- grain: one row per unnamed topic
-- param: only_run BIGINT  Run to look at
-- column: run_id
-- column: message_count BIGINT  Messages published, or taken where no publisher is known
-- column: publishers VARCHAR  Nodes that publish, or their processes in brackets; NULL: not known
-- column: subscribers VARCHAR  Nodes that take the messages, likewise
-- column: publishing_node_id BIGINT  First of the nodes that publish
-- column: node_id BIGINT  First of the nodes that take the messages
-- column: entry VARCHAR  What an entry of a file of links knows the topic by
CREATE OR REPLACE MACRO main.unnamed_topic(only_run) AS TABLE
WITH published AS (
    SELECT
        publisher_id,
        count(*) AS message_count
    FROM store.publication
    WHERE run_id = only_run
    GROUP BY publisher_id
),
taken AS (
    SELECT
        subscription_id,
        count(*) AS message_count
    FROM store.take
    WHERE run_id = only_run
    GROUP BY subscription_id
),
member AS (
    SELECT
        e.run_id, e.kind, e.id, e.entry, e.node_id,
        coalesce(g.group_id, e.vertex) AS group_id,
        coalesce(b.message_count, t.message_count, 0) AS message_count,
        main.node_label(n.full_name, e.process_name, e.pid) AS node
    FROM derive.unnamed_endpoint(only_run) AS e
    LEFT JOIN derive.topic_group(only_run) AS g ON e.kind = g.kind AND e.id = g.id
    LEFT JOIN published AS b ON e.kind = 'publisher' AND e.id = b.publisher_id
    LEFT JOIN taken AS t ON e.kind = 'subscription' AND e.id = t.subscription_id
    LEFT JOIN store.node AS n ON e.node_id = n.node_id
    WHERE e.topic_name IS NULL
)
SELECT
    run_id,
    coalesce(
        sum(message_count) FILTER (kind = 'publisher'), max(message_count)
    )::BIGINT AS message_count,
    nullif(derive.names_in_words(CASE WHEN kind = 'publisher' THEN node END), '') AS publishers,
    nullif(derive.names_in_words(CASE WHEN kind = 'subscription' THEN node END), '') AS subscribers,
    min(node_id) FILTER (kind = 'publisher') AS publishing_node_id,
    min(node_id) FILTER (kind = 'subscription') AS node_id,
    arg_min(entry, (kind <> 'publisher', -message_count, id)) AS entry
FROM member
GROUP BY run_id, group_id
HAVING max(message_count) > 0
