-- title: Callback instances of a replay
-- description: As a recording of the changed system would have them.
-- grain: one row per callback instance
-- reads: replay_ran
-- param: outside_id BIGINT  Thread of a process outside of its executors: so much above its id
SELECT
    r.ran_id AS callback_instance_id,
    s.trace_id, r.callback_id, c.process_id, r.thread_id, r.start_ns, r.end_ns,
    CASE WHEN r.serial IS NOT NULL THEN r.ran_id END AS take_id,
    false AS is_intra_process,
    1 AS depth,
    b.event_id AS start_event_id,
    e.event_id AS end_event_id,
    e.event_id AS effective_end_event_id,
    false AS is_loss_affected
FROM replay_ran AS r
JOIN main.callback AS c ON r.callback_id = c.callback_id
JOIN predicted_source AS s ON c.process_id = s.process_id
JOIN predicted_event AS b ON r.ran_id = b.ran_id AND b.step = 4
JOIN predicted_event AS e ON r.ran_id = e.ran_id AND e.step = 6
