-- title: Reasons of messages that were not taken, counted over runs
-- description: Adds up the columns reasons and orphan_reasons of topics_delivery.
-- grain: one row per group of runs, topic, receiving node and column
-- kind: inline
WITH listed AS (
    SELECT
        label_group, topic_name, subscriber,
        'reasons' AS name,
        unnest(map_entries(reasons)) AS entry
    FROM topics_delivery
    UNION ALL
    SELECT
        label_group, topic_name, subscriber, 'orphan_reasons',
        unnest(map_entries(orphan_reasons))
    FROM topics_delivery
),
counted AS (
    SELECT
        label_group, topic_name, subscriber, name,
        entry.key AS reason,
        sum(entry.value)::BIGINT AS number
    FROM listed
    GROUP BY label_group, topic_name, subscriber, name, reason
)
SELECT
    label_group, topic_name, subscriber, name,
    map(
        list(reason ORDER BY number DESC, reason), list(number ORDER BY number DESC, reason)
    ) AS numbers
FROM counted
GROUP BY label_group, topic_name, subscriber, name
