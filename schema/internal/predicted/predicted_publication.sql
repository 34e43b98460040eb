-- title: Publications of a replay
-- description: As a recording of the changed system would have them. The stamp tells a message from
--     all others of its topic.
-- grain: one row per publication
-- reads: replay_sent
-- param: outside_id BIGINT  Thread of a process outside of its executors: so much above its id
SELECT
    e.serial AS publication_id,
    b.trace_id, b.publisher_id, b.process_id, e.thread_id,
    e.at_ns AS start_ns,
    e.at_ns AS end_ns,
    e.at_ns AS rmw_ns,
    e.serial AS source_timestamp_ns,
    e.event_id AS start_event_id,
    e.event_id AS end_event_id,
    c.event_id AS callback_event_id,
    false AS is_loss_affected
FROM predicted_event AS e
JOIN replay_sent AS s ON e.serial = s.serial
JOIN main.publication AS b ON s.publication_id = b.publication_id
LEFT JOIN predicted_event AS c ON e.ran_id = c.ran_id AND c.step = 4
WHERE e.step = 5
