-- title: Messages that are lost on the way
-- description: Between messages that arrive; not in a queue.
-- grain: one row per topic and node that takes it
-- reads: application_path, delivery, noticed
-- next: query topics --measure unmatched --topic {topic_name}
SELECT
    7 AS place,
    d.subscriber AS node,
    a.path, d.topic_name,
    (a.length_ns::DOUBLE * d.lost / greatest(d.delivered, 1) / d.published)::BIGINT AS harm_ns,
    NULL::BIGINT AS p95_ns,
    d.lost, d.published,
    [d.subscriber || coalesce(d.topic_name, '?') || ' lost'] AS claims
FROM (
    SELECT
        subscriber, topic_name,
        sum(lost)::BIGINT AS lost,
        sum(delivered)::BIGINT AS delivered,
        sum(delivered + dropped + lost)::BIGINT AS published
    FROM delivery
    GROUP BY subscriber, topic_name
) AS d
JOIN application_path AS a
    ON contains(
        a.path || ' → ', printf(' → %s → %s → ', coalesce(d.topic_name, '?'), d.subscriber)
    )
CROSS JOIN noticed AS l
WHERE d.lost >= l.lost AND d.lost >= l.of_messages * d.published
QUALIFY row_number() OVER (
    PARTITION BY d.subscriber, d.topic_name ORDER BY a.age_ns DESC, a.path
) = 1
