-- description: Takes of the messages whose publication was found by time. A subscription takes a
--     message once, and those of a publisher in the order in which they were published: what
--     seems to be older than one taken before is not linked. The link is doubtful where events may
--     be lost around the moment of publishing.
-- grain: one row per take whose publication is known by time
-- when: store.nearest_message
CREATE OR REPLACE MACRO derive.link_transport_nearest(only_run) AS TABLE
WITH received AS (
    SELECT
        t.run_id, t.take_id, t.taken_ns, t.subscription_id, t.source_timestamp_ns,
        m.publication_id, m.candidate_count
    FROM store.nearest_message AS m
    JOIN store.subscription AS s ON m.run_id = s.run_id AND m.topic_name = s.topic_name
    JOIN store.take AS t
        ON s.subscription_id = t.subscription_id AND m.source_timestamp_ns = t.source_timestamp_ns
    WHERE m.run_id = only_run AND t.run_id = only_run
    QUALIFY row_number() OVER (
        PARTITION BY t.subscription_id, t.source_timestamp_ns ORDER BY t.take_id
    ) = 1
),
sent AS MATERIALIZED (
    SELECT
        r.run_id, r.take_id, r.taken_ns, r.subscription_id, r.publication_id, r.candidate_count,
        b.publisher_id
    FROM received AS r
    JOIN store.publication AS b ON r.publication_id = b.publication_id
    WHERE b.run_id = only_run
    -- Threads that take messages of one subscription may be held up. Each take is compared with the
    -- latest publication, not with that of the take before: after a jump, many takes seem to be
    -- old, but follow each other in order.
    QUALIFY max(b.end_ns) OVER (
        PARTITION BY r.subscription_id, b.publisher_id ORDER BY r.taken_ns, r.take_id
        ROWS UNBOUNDED PRECEDING
    ) - b.end_ns <= derive.clock_limit().write_ns
)
SELECT
    s.run_id, s.publication_id, s.take_id, s.publisher_id, s.subscription_id,
    'nearest' AS method,
    s.candidate_count,
    a.publication_id IS NOT NULL AS is_loss_affected
FROM sent AS s
LEFT JOIN derive.publication_beside_gap('sent') AS a ON s.publication_id = a.publication_id
