-- description: A subscription gets a message after it was sent, and soon: within the time in which
--     99 % of the traced takes of its topic got theirs, of all topics where none is traced. It was
--     sent when the stamp of the middleware says, which is of the clock of ROS as the bag is. On
--     which host the recorder ran is not known: clocks may differ by the largest correction and
--     its uncertainty, in either direction. A message is joined if exactly one publication of its
--     topic was sent in that time, and no other message of the bag may be that one too.
-- grain: one row per message of the bag
-- reads: bag_read
WITH sent AS (
    SELECT
        b.publication_id, p.topic_name,
        coalesce(b.source_timestamp_ns, b.start_ns) AS sent_ns
    FROM main.publication AS b
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE b.run_id = $run_id
),
taken AS (
    SELECT
        s.topic_name,
        t.taken_ns - b.start_ns AS after_ns
    FROM main.link_transport AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    JOIN main.take AS t ON l.take_id = t.take_id
    JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    -- Not those that were stored until the subscription existed.
    WHERE l.run_id = $run_id AND l.latency_ns IS NOT NULL
),
uncertainty AS (
    SELECT
        coalesce(
            max(
                abs(c.offset_ns) + abs(c.drift_ppb) * ((r.end_ns - r.start_ns) / 1e9)
                + coalesce(c.uncertainty_ns, 0)
            ),
            0
        )::BIGINT AS uncertainty_ns
    FROM main.clock AS c
    JOIN main.run AS r ON c.run_id = r.run_id
    WHERE c.run_id = $run_id
),
bound AS (
    SELECT
        n.topic_name,
        coalesce(
            quantile_disc(t.after_ns, 0.99), (SELECT quantile_disc(after_ns, 0.99) FROM taken), 0
        ) + any_value(u.uncertainty_ns) AS bound_ns,
        any_value(u.uncertainty_ns) AS uncertainty_ns
    FROM (SELECT DISTINCT topic_name FROM sent) AS n
    LEFT JOIN taken AS t ON n.topic_name = t.topic_name
    CROSS JOIN uncertainty AS u
    GROUP BY n.topic_name
),
candidate AS (
    SELECT
        m.message, s.publication_id,
        count(*) OVER (PARTITION BY m.message) AS publications,
        count(*) OVER (PARTITION BY s.publication_id) AS messages
    FROM bag_read AS m
    JOIN bound AS b ON m.topic_name = b.topic_name
    JOIN sent AS s
        ON m.topic_name = s.topic_name
        AND s.sent_ns BETWEEN m.received_ns - b.bound_ns AND m.received_ns + b.uncertainty_ns
)
SELECT
    m.message, m.topic_name, m.type_name, m.received_ns, m.size_bytes, m.stamp_ns, m.frame_id,
    CASE WHEN c.publications = 1 AND c.messages = 1 THEN c.publication_id END AS publication_id,
    CASE
        WHEN b.topic_name IS NULL THEN 'topic_not_published'
        WHEN c.message IS NULL THEN 'no_publication'
        WHEN c.publications > 1 OR c.messages > 1 THEN 'ambiguous'
    END AS reason,
    b.bound_ns
FROM bag_read AS m
LEFT JOIN bound AS b ON m.topic_name = b.topic_name
LEFT JOIN candidate AS c ON m.message = c.message
QUALIFY row_number() OVER (PARTITION BY m.message ORDER BY c.publication_id) = 1
ORDER BY m.message
