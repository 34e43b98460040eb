-- title: Messages that end at a node which publishes
-- description: No callback of a subscription led to anything, or few did, but the node publishes by
--     a timer, outside of callbacks, or because of other messages. If it keeps the messages for
--     that, paths and flows that should go on end there, and no end-to-end latency goes through the
--     node.
-- cause: The trace does not show that a node keeps a message for later. Or it really only consumes
--     these messages.
-- cure: msgflow suggest links writes a file with the links that are likely; with --apply it
--     declares them at once. Where a node only consumes messages, an entry of kind independent says
--     so (docs/links.md).
-- next: suggest links
-- grain: one row per node and topic
-- severity: warning
-- when: derive.unanswered_subscription
WITH dead_end AS MATERIALIZED (FROM main.dead_end([$run_id])),
input AS (
    SELECT
        node_id, topic_name,
        sum(message_count)::BIGINT AS number,
        sum(leading_count)::BIGINT AS leading
    FROM (
        SELECT DISTINCT node_id, subscription_id, topic_name, message_count, leading_count
        FROM dead_end
        WHERE is_likely
    )
    GROUP BY node_id, topic_name
),
output AS (
    SELECT
        node_id,
        derive.names_in_words(published) AS published
    FROM (
        SELECT
            node_id,
            derive.names_in_words(output_topic) || ' ' || cause AS published
        FROM dead_end
        WHERE is_likely
        GROUP BY node_id, cause
    )
    GROUP BY node_id
)
SELECT
    n.run_id,
    min(i.node_id) AS node_id,
    i.topic_name,
    sum(i.number - i.leading)::BIGINT AS count,
    printf(
        '%s%s on %s end at %s, which publishes %s',
        CASE WHEN sum(i.leading) > 0 THEN printf('%d of ', sum(i.number - i.leading)::BIGINT)
            ELSE '' END,
        derive.counted(sum(i.number)::BIGINT, 'message'), i.topic_name,
        main.node_label(n.full_name, p.name, p.pid), min(o.published)
    ) AS detail
FROM input AS i
JOIN output AS o ON i.node_id = o.node_id
JOIN store.node AS n ON i.node_id = n.node_id
JOIN store.process AS p ON n.process_id = p.process_id
-- A node that is made again is one.
GROUP BY n.run_id, n.full_name, p.name, p.pid, i.topic_name
