-- description: What the query critical-path is asked of a picked thing: the flow from the first
--     message that led to it (of what a timer began, from the first that it led to) to the last
--     take that it led to. Where it led to none, to the last take that led to it.
-- grain: one row per picked thing; none where its flow has no take
-- param: kind, id
-- column: from_topic VARCHAR  Topic of the first message
-- column: to_topic VARCHAR  Topic of the last take
-- column: take_id BIGINT  Identity of the take
WITH reached AS MATERIALIZED (
    SELECT
        kind, id,
        true AS is_effect
    FROM main.flow_forward($kind, $id)
    UNION ALL
    SELECT kind, id, false
    FROM main.flow_backward($kind, $id)
),
origin AS (
    SELECT p.topic_name
    FROM reached AS r
    JOIN main.publication AS b ON r.kind = 'publication' AND r.id = b.publication_id
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE p.topic_name IS NOT NULL AND NOT p.is_internal
    ORDER BY r.is_effect, b.start_ns, b.publication_id
    LIMIT 1
),
arrival AS (
    SELECT t.take_id, s.topic_name
    FROM reached AS r
    JOIN main.take AS t ON r.kind = 'take' AND r.id = t.take_id
    JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    LEFT JOIN main.callback_instance AS i ON t.take_id = i.take_id
    WHERE s.topic_name IS NOT NULL AND NOT s.is_internal
    ORDER BY r.is_effect DESC, coalesce(i.end_ns, i.start_ns, t.taken_ns) DESC, t.take_id
    LIMIT 1
)
SELECT
    o.topic_name AS from_topic,
    a.topic_name AS to_topic,
    a.take_id
FROM arrival AS a
CROSS JOIN origin AS o
ORDER BY a.take_id
