-- description: How long each subscription could take messages, on the clock of its host: from its
--     creation to the last event of the threads that read it, or until its handle was used again,
--     or another one took its place: of its node, which was made again, or made that one. A
--     placeholder for the reader of a ring buffer is left out: it may be the same subscription as
--     the one for what comes through the middleware, so that it is not known what it should have
--     got.
-- grain: one row per subscription with a handle
WITH reader AS (
    SELECT
        r.subscription_id,
        count(*) AS thread_count,
        max(t.last_seen_ns) AS last_seen_ns,
        any_value(r.thread_id) AS thread_id
    FROM derive.subscription_reader AS r
    JOIN store.thread AS t ON r.thread_id = t.thread_id
    GROUP BY r.subscription_id
),
-- Before Humble takes have no event of their own.
showing AS (
    SELECT host_id
    FROM store.process
    WHERE process_id IN (SELECT process_id FROM store.take WHERE source_timestamp_ns IS NOT NULL)
)
SELECT
    s.run_id, s.subscription_id,
    derive.own_topic(s.topic_name, s.is_agnocast, h.clock_id) AS topic_name,
    s.is_agnocast, s.process_id, h.clock_id,
    nullif(s.queue_depth, 0) AS queue_depth,
    s.created_ns,
    coalesce(r.last_seen_ns, p.last_seen_ns) AS last_seen_ns,
    least(
        CASE
            WHEN s.subscription_handle IS NOT NULL
                THEN lead(s.created_ns) OVER (
                    PARTITION BY s.run_id, s.process_id, s.subscription_handle
                    ORDER BY s.created_ns NULLS FIRST, s.subscription_id
                )
        END,
        -- A node may have two on one topic: then the first one goes on.
        CASE
            WHEN n.full_name IS NOT NULL AND t.taken_ns < lead(s.created_ns) OVER alike
                THEN lead(s.created_ns) OVER alike
        END
    ) AS replaced_ns,
    p.host_end_ns,
    CASE WHEN r.thread_count = 1 THEN r.thread_id END AS only_thread_id,
    p.host_id IN (SELECT host_id FROM showing) AS shows_takes
FROM store.subscription AS s
JOIN (
    SELECT
        process_id, host_id, last_seen_ns,
        max(last_seen_ns) OVER (PARTITION BY host_id) AS host_end_ns
    FROM store.process
) AS p ON s.process_id = p.process_id
JOIN store.host AS h ON p.host_id = h.host_id
LEFT JOIN reader AS r ON s.subscription_id = r.subscription_id
LEFT JOIN store.node AS n ON s.node_id = n.node_id
LEFT JOIN (
    SELECT
        subscription_id,
        max(taken_ns) AS taken_ns
    FROM store.take
    GROUP BY subscription_id
) AS t
    ON s.subscription_id = t.subscription_id
WINDOW alike AS (
    PARTITION BY s.run_id, s.process_id, n.full_name, s.topic_name
    ORDER BY s.created_ns NULLS FIRST, s.subscription_id
)
QUALIFY NOT coalesce(s.is_inferred AND s.rmw_handle IS NULL, false)
