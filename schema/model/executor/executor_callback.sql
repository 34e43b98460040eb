-- description: The first callback instance after an event of an executor, with no begin or end of
--     a callback between the two. A step of its own, so that only these few columns are in memory
--     when states look it up.
-- grain: one row per executor event that a callback directly followed
-- when: staging.callback_number

-- Of those behind one event, only the first has no other callback before it.
SELECT p.executor_event_id, n.callback_instance_id
FROM staging.callback_run AS p
JOIN staging.callback_number AS n ON p.start_event_id = n.start_event_id
WHERE coalesce(p.previous_callback_event_id < p.executor_event_id, p.executor_event_id IS NOT NULL)
