-- title: What became of the messages of a bag, by topic
-- description: How many messages were published and taken by the recorder while the bag was
--     recorded, how many it has, how many of those were joined to their publication, and why others
--     were not. The recorder is the node rosbag2_recorder.
-- grain: one row per topic of the bag, and per other topic that the recorder took messages on
-- reads: bag_joined
-- column: topic_name VARCHAR [topic]  Name of the topic
-- column: published BIGINT  Messages published, as traced, from the first message of the bag to the
--     last one of any topic
-- column: taken BIGINT  Messages that the recorder took in that time; NULL: it is not traced
-- column: messages BIGINT  Messages in the bag
-- column: joined BIGINT  Those whose publication is known
-- column: ambiguous BIGINT  Those that may be of several publications, or whose publication may
--     have another message
-- column: no_publication BIGINT  Those whose publication the trace does not have
-- column: topic_not_published BIGINT  Those of topics without a publication in the run
-- column: bound_ns BIGINT [ns]  How long after it was sent a message may be received
WITH in_bag AS (
    SELECT
        topic_name,
        count(*) AS messages,
        count(publication_id) AS joined,
        count(*) FILTER (reason = 'ambiguous') AS ambiguous,
        count(*) FILTER (reason = 'no_publication') AS no_publication,
        count(*) FILTER (reason = 'topic_not_published') AS topic_not_published,
        any_value(bound_ns) AS bound_ns
    FROM bag_joined
    GROUP BY topic_name
),
recorded AS (
    SELECT
        min(received_ns - coalesce(bound_ns, 0)) AS start_ns,
        max(received_ns) AS end_ns
    FROM bag_joined
),
sent AS (
    SELECT
        p.topic_name,
        count(*) AS published
    FROM main.publication AS b
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    JOIN recorded AS r ON b.start_ns BETWEEN r.start_ns AND r.end_ns
    WHERE b.run_id = $run_id
    GROUP BY p.topic_name
),
recorder AS (
    SELECT s.subscription_id, s.topic_name
    FROM main.subscription AS s
    JOIN main.node AS n ON s.node_id = n.node_id
    WHERE s.run_id = $run_id AND NOT s.is_internal AND contains(n.full_name, '/rosbag2_recorder')
),
heard AS (
    SELECT
        s.topic_name,
        count(r.end_ns) AS taken
    FROM recorder AS s
    LEFT JOIN main.take AS t ON s.subscription_id = t.subscription_id
    LEFT JOIN recorded AS r ON t.taken_ns BETWEEN r.start_ns AND r.end_ns
    GROUP BY s.topic_name
)
SELECT
    coalesce(m.topic_name, h.topic_name) AS topic_name,
    coalesce(s.published, 0) AS published,
    h.taken,
    coalesce(m.messages, 0) AS messages,
    coalesce(m.joined, 0) AS joined,
    coalesce(m.ambiguous, 0) AS ambiguous,
    coalesce(m.no_publication, 0) AS no_publication,
    coalesce(m.topic_not_published, 0) AS topic_not_published,
    m.bound_ns
FROM in_bag AS m
FULL JOIN (FROM heard WHERE taken > 0) AS h ON m.topic_name = h.topic_name
LEFT JOIN sent AS s ON coalesce(m.topic_name, h.topic_name) = s.topic_name
ORDER BY topic_name
