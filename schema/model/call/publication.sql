-- kind: inline
-- description: Publications, numbered in the order of their calls, with their publisher.
-- grain: one row per publish() call
SELECT
    n.publication_id,
    c.trace_index + 1 AS trace_id,
    coalesce(p.publisher_id, i.publisher_id) AS publisher_id,
    c.process_id, c.thread_id, c.start_ns, c.end_ns, c.intra_ns, c.rclcpp_ns, c.rcl_ns, c.rmw_ns,
    c.dds_ns, c.source_timestamp_ns, c.start_event_id, c.end_event_id,
    -- The end of a callback without its begin does not say where the thread is.
    CASE WHEN e.event_id IS NULL THEN c.callback_event_id ELSE e.previous_event_id END
        AS callback_event_id,
    l.start_event_id IS NOT NULL AS is_loss_affected,
    x.next_event_ns
FROM staging.publication_call AS c
JOIN staging.publication_number AS n ON c.start_event_id = n.start_event_id
LEFT JOIN staging.publisher AS p ON n.publisher_event_id = p.event_id
LEFT JOIN (SELECT * FROM staging.publisher WHERE is_inferred) AS i
    ON n.process_id = i.process_id AND n.unknown_handle = i.publisher_handle
LEFT JOIN staging.callback_end_alone AS e ON c.callback_event_id = e.event_id
LEFT JOIN (SELECT * FROM staging.loss_affected WHERE kind = 'publication') AS l
    ON c.start_event_id = l.start_event_id
LEFT JOIN staging.publication_next AS x ON c.start_event_id = x.start_event_id
