-- kind: inline
-- description: Callback instances, numbered in the order in which they began, with the one that
--     each is nested in.
-- grain: one row per callback instance
SELECT
    n.callback_instance_id,
    r.trace_index + 1 AS trace_id,
    n.callback_id, r.process_id, r.thread_id, r.start_ns,
    coalesce(r.end_ns, d.end_ns) AS end_ns,
    n.take_id, q.request_id, s.response_id,
    s.callback_instance_id AS continues_id,
    s.step_event_id, r.is_intra_process, p.parent_id, r.depth, r.start_event_id, r.end_event_id,
    r.effective_end_event_id,
    g.start_event_id IS NOT NULL AS is_loss_affected
FROM staging.callback_run AS r
JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
LEFT JOIN (
    SELECT
        i.start_event_id,
        o.callback_instance_id AS parent_id
    FROM staging.callback_run AS i
    JOIN staging.callback_number AS o ON i.parent_event_id = o.start_event_id
) AS p ON r.start_event_id = p.start_event_id
LEFT JOIN staging.deferred_end AS d ON r.start_event_id = d.start_event_id
LEFT JOIN (SELECT * FROM staging.loss_affected WHERE kind = 'callback') AS g
    ON r.start_event_id = g.start_event_id
LEFT JOIN staging.request AS q ON r.start_event_id = q.callback_start_event_id
LEFT JOIN (
    SELECT b.start_event_id, b.step_event_id, f.callback_instance_id, y.response_id
    FROM staging.callback_binding AS b
    LEFT JOIN staging.callback_number AS f ON b.call_event_id = f.start_event_id
    LEFT JOIN staging.response AS y ON b.response_event_id = y.take_event_id
    WHERE b.call_event_id IS NOT NULL OR b.response_event_id IS NOT NULL
) AS s ON r.start_event_id = s.start_event_id
