-- kind: inline
-- description: Publications, numbered in the order of their calls, with their publisher.
-- grain: one row per publish() call

-- The end of a callback without its begin does not say where the thread is. What came before does.
WITH stray AS (
    SELECT c.start_event_id, c.thread_id
    FROM staging.publication_call AS c
    JOIN staging.callback_pair_left_over AS e ON c.callback_event_id = e.event_id
    WHERE NOT e.is_start AND e.partner_event_id IS NULL
),
placed AS (
    SELECT s.start_event_id, e.event_id AS callback_event_id
    FROM stray AS s
    ASOF LEFT JOIN (
        SELECT thread_id, start_event_id AS event_id
        FROM staging.callback_pair
        WHERE thread_id IN (SELECT thread_id FROM stray)
        UNION ALL
        SELECT thread_id, end_event_id
        FROM staging.callback_pair
        WHERE end_event_id IS NOT NULL AND thread_id IN (SELECT thread_id FROM stray)
    ) AS e ON s.thread_id = e.thread_id AND s.start_event_id > e.event_id
)
SELECT
    n.publication_id,
    c.trace_index + 1 AS trace_id,
    coalesce(p.publisher_id, i.publisher_id) AS publisher_id,
    c.process_id, c.thread_id, c.start_ns, c.end_ns, c.intra_ns, c.rclcpp_ns, c.rcl_ns, c.rmw_ns,
    c.dds_ns, c.source_timestamp_ns, c.start_event_id, c.end_event_id,
    CASE WHEN q.start_event_id IS NULL THEN c.callback_event_id ELSE q.callback_event_id END
        AS callback_event_id,
    l.start_event_id IS NOT NULL AS is_loss_affected,
    x.next_event_ns
FROM staging.publication_call AS c
JOIN staging.publication_number AS n ON c.start_event_id = n.start_event_id
LEFT JOIN staging.publisher AS p ON n.publisher_event_id = p.event_id
LEFT JOIN (SELECT * FROM staging.publisher WHERE is_inferred) AS i
    ON n.process_id = i.process_id AND n.unknown_handle = i.publisher_handle
LEFT JOIN placed AS q ON c.start_event_id = q.start_event_id
LEFT JOIN (SELECT * FROM staging.loss_affected WHERE kind = 'publication') AS l
    ON c.start_event_id = l.start_event_id
LEFT JOIN staging.publication_next AS x ON c.start_event_id = x.start_event_id
