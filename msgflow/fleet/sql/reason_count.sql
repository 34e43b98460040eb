-- title: Reasons of messages that were not taken, counted over runs
-- description: Adds up what stands in the column reasons of delivery as 'reason 3, other 2'.
-- grain: one row per group of runs, topic, receiving node and column
-- kind: inline
WITH listed AS (
    SELECT d.label_group, d.topic_name, d.subscriber, 'reasons' AS name, d.reasons AS text
    FROM topics_delivery AS d
    UNION ALL
    SELECT d.label_group, d.topic_name, d.subscriber, 'orphan_reasons', d.orphan_reasons
    FROM topics_delivery AS d
),
part AS (
    SELECT label_group, topic_name, subscriber, name, unnest(string_split(text, ', ')) AS text
    FROM listed
),
counted AS (
    SELECT
        label_group, topic_name, subscriber, name,
        regexp_extract(text, '^(.*) \d+$', 1) AS reason,
        sum(regexp_extract(text, ' (\d+)$', 1)::BIGINT) AS number
    FROM part
    GROUP BY label_group, topic_name, subscriber, name, reason
)
SELECT
    label_group, topic_name, subscriber, name,
    string_agg(reason || ' ' || number, ', ' ORDER BY number DESC, reason) AS text
FROM counted
GROUP BY label_group, topic_name, subscriber, name
