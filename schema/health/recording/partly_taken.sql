-- title: A subscription that gets only a part of the messages of a publisher
-- description: Between messages that it took, many others did not reach it, although its queue had
--     room. They count as lost (not_delivered, lost_in_transport). A content filter leaves no
--     event, so that what it holds back looks the same: then nothing is lost.
-- cause: The subscription has a content filter (content_filter_options), or the middleware a filter
--     by time; or a best-effort connection is overloaded, or a lifespan too short.
-- cure: None needed for a filter. Else see the QoS of both with ros2 topic info --verbose, and
--     where the messages are large, the buffers of the network (net.core.rmem_max).
-- grain: one row per topic, publishing node and subscribing node
-- severity: info
-- when: store.undelivered WHERE reason IN ('not_delivered', 'lost_in_transport')
WITH pair AS (
    SELECT
        run_id, topic_name, subject, taken,
        min(node_id) AS node_id,
        min(publishing_node_id) AS publishing_node_id,
        sum(number)::BIGINT AS untaken,
        sum(number) FILTER (reason IN ('not_delivered', 'lost_in_transport'))::BIGINT AS missing
    FROM untaken_pair
    GROUP BY run_id, topic_name, subject, taken
)
SELECT
    run_id, node_id, publishing_node_id, topic_name, subject,
    missing AS count,
    printf(
        '%d of %d messages reached it (%.0f %%)',
        taken, taken + untaken, 100 * taken / (taken + untaken)
    ) AS detail
FROM pair
-- A few may get lost at any time.
WHERE missing >= 10 AND missing * 5 >= taken + missing
