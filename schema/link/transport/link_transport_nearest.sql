-- name: derive.link_transport_nearest
-- kind: macro
-- description: Takes of the messages whose publication was found by time. A subscription takes a
--     message once, and those of a publisher in the order in which they were published. A message
--     that seems older than one taken before was stamped after the clock had been set back: it has
--     no row. After that, a message whose stamp is further from its publication than the clock then
--     allows fits by chance. It has no row either, unless the clock is known to have been behind
--     meanwhile: then it was set forward again. The link is doubtful where events may be lost
--     around the moment of publishing.
-- grain: one row per take whose publication is known by time
-- when: store.nearest_message
-- param: only_run BIGINT  Run to look at
CREATE OR REPLACE MACRO derive.link_transport_nearest(only_run) AS TABLE
WITH received AS (
    SELECT
        t.run_id, t.take_id, t.taken_ns, t.subscription_id, t.source_timestamp_ns,
        m.publication_id, m.candidate_count
    FROM store.nearest_message AS m
    JOIN store.subscription AS s ON m.run_id = s.run_id AND m.topic_name = s.topic_name
    JOIN store.take AS t
        ON s.subscription_id = t.subscription_id
        AND m.source_timestamp_ns = t.source_timestamp_ns
    WHERE m.run_id = only_run AND t.run_id = only_run
    QUALIFY row_number() OVER (
        PARTITION BY t.subscription_id, t.source_timestamp_ns ORDER BY t.take_id
    ) = 1
),
sent AS MATERIALIZED (
    SELECT
        r.run_id, r.take_id, r.taken_ns, r.subscription_id, r.publication_id, r.candidate_count,
        b.publisher_id, b.process_id, b.end_ns, r.source_timestamp_ns - b.end_ns AS difference_ns
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
),
set_back AS (
    SELECT
        z.subscription_id, z.taken_ns, s.end_ns,
        s.difference_ns - z.set_back_ns + derive.clock_limit().write_ns AS most_ns
    FROM derive.clock_set_back(only_run) AS z
    ASOF JOIN sent AS s ON z.subscription_id = s.subscription_id AND z.taken_ns > s.taken_ns
    WHERE z.is_lasting
),
behind AS (
    SELECT s.take_id, h.clock_id, z.end_ns AS since_ns, s.end_ns AS until_ns, z.most_ns
    FROM sent AS s
    JOIN store.process AS o ON s.process_id = o.process_id
    JOIN store.host AS h ON o.host_id = h.host_id
    ASOF JOIN set_back AS z
        ON s.subscription_id = z.subscription_id AND s.taken_ns >= z.taken_ns
    WHERE s.difference_ns > z.most_ns
),
chance AS (
    SELECT b.take_id
    FROM behind AS b
    ANTI JOIN store.stamp_clock AS c
        ON b.clock_id = c.clock_id
        AND c.difference_ns <= b.most_ns
        AND c.end_ns > b.since_ns
        AND c.start_ns <= b.until_ns
)
SELECT
    s.run_id,
    s.publication_id,
    s.take_id,
    s.publisher_id,
    s.subscription_id,
    'nearest' AS method,
    s.candidate_count,
    a.publication_id IS NOT NULL AS is_loss_affected
FROM sent AS s
LEFT JOIN derive.publication_beside_gap('sent') AS a ON s.publication_id = a.publication_id
ANTI JOIN chance AS c ON s.take_id = c.take_id
