-- title: Takes of a replay
-- description: As a recording of the changed system would have them.
-- grain: one row per take
-- reads: replay_ran
-- param: outside_id BIGINT  Thread of a process outside of its executors: so much above its id
SELECT
    e.ran_id AS take_id,
    s.trace_id, c.subscription_id, c.process_id, e.thread_id,
    e.at_ns AS taken_ns,
    e.serial AS source_timestamp_ns,
    'rmw' AS method,
    e.event_id AS start_event_id,
    e.event_id AS end_event_id,
    false AS is_loss_affected
FROM predicted_event AS e
JOIN replay_ran AS r ON e.ran_id = r.ran_id
JOIN main.callback AS c ON r.callback_id = c.callback_id
JOIN predicted_source AS s ON c.process_id = s.process_id
WHERE e.step = 3
