-- name: derive.link_transport_nearest
-- kind: macro
-- description: Takes of the messages whose publication was found by time. A subscription takes a
--     message once. What may be lost around the moment of publishing makes the link doubtful.
-- grain: one row per take whose publication is known by time
-- param: only_run BIGINT  Run to look at
-- needs: store.nearest_message, store.take, store.subscription, store.publication,
--     store.loss_interval
CREATE OR REPLACE MACRO derive.link_transport_nearest(only_run) AS TABLE
WITH received AS (
    SELECT
        t.run_id, t.take_id, t.subscription_id, m.publication_id, m.candidate_count
    FROM store.nearest_message AS m
    JOIN store.subscription AS s ON m.run_id = s.run_id AND m.topic_name = s.topic_name
    JOIN store.take AS t
        ON s.subscription_id = t.subscription_id
        AND m.source_timestamp_ns = t.source_timestamp_ns
    WHERE m.run_id = only_run AND t.run_id = only_run AND m.publication_id IS NOT NULL
    QUALIFY row_number() OVER (
        PARTITION BY t.subscription_id, t.source_timestamp_ns ORDER BY t.take_id
    ) = 1
),
affected AS (
    SELECT b.publication_id
    FROM store.publication AS b
    ASOF JOIN store.loss_interval AS l
        ON b.trace_id = l.trace_id
        AND coalesce(b.next_event_ns, b.end_ns + 5000000) >= l.start_ns
    WHERE b.run_id = only_run
        AND l.end_ns >= b.start_ns
        AND b.publication_id IN (SELECT publication_id FROM received)
)
SELECT
    r.run_id,
    r.publication_id,
    r.take_id,
    b.publisher_id,
    r.subscription_id,
    'nearest' AS method,
    r.candidate_count,
    a.publication_id IS NOT NULL AS is_loss_affected
FROM received AS r
JOIN store.publication AS b ON r.publication_id = b.publication_id
LEFT JOIN affected AS a ON r.publication_id = a.publication_id
WHERE b.run_id = only_run
