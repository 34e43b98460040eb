-- title: States of executors of a replay
-- description: As a recording of the changed system would have them.
-- grain: one row per executor event of a thread
-- param: outside_id BIGINT  Thread of a process outside of its executors: so much above its id
SELECT
    thread_id,
    ['process', 'execute', NULL, NULL, NULL, NULL, 'wait'][step] AS state,
    at_ns AS start_ns,
    false AS is_behind_gap,
    CASE WHEN step = 2 THEN ran_id END AS callback_instance_id,
    event_id AS start_event_id
FROM predicted_event
WHERE step IN (1, 2, 7)
