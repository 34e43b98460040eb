-- description: Begins of callbacks whose end is the next begin or end of any callback on their
--     thread, with that end. No gap lies between.
-- grain: one row per such begin and end
-- when: raw.ros2_callback_start
SELECT
    s.event_id AS start_event_id, e.event_id AS end_event_id, s.ts_ns AS start_ns,
    e.ts_ns AS end_ns, s.trace_index, c.thread_id, c.process_id, s.callback AS callback_handle,
    coalesce(s.is_intra_process = 1, false) AS is_intra_process,
    CASE WHEN g.event_id IS NULL THEN s.previous_call_event_id END AS previous_event_id,
    s.previous_callback_event_id, s.previous_executor_event_id,
    CASE WHEN x.event_id IS NULL THEN s.previous_executor_event_id END AS executor_event_id
FROM raw.ros2_callback_start AS s
JOIN raw.ros2_callback_end AS e
    ON s.event_id = e.previous_callback_event_id AND s.callback = e.callback
JOIN staging.context AS c
    ON s.thread_index = c.thread_index
    AND s.event_id >= c.from_event_id
    AND e.event_id < c.until_event_id
LEFT JOIN staging.callback_pair_segment AS m ON s.event_id = m.event_id
LEFT JOIN staging.callback_pair_segment AS n ON e.event_id = n.event_id
LEFT JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'call' AND is_behind) AS g
    ON s.event_id = g.event_id
LEFT JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'executor' AND is_behind) AS x
    ON s.event_id = x.event_id
WHERE m.segment IS NOT DISTINCT FROM n.segment
