-- description: Events of the user's own tracepoints, as moments on their threads.
-- grain: one row per event
SELECT
    thread_id, name, user_event_id, fields,
    at_ns AS start_ns,
    at_ns AS end_ns,
    'user_event' AS category
FROM main.user_event
WHERE run_id = $run_id AND at_ns >= $start_ns AND at_ns < $end_ns
ORDER BY thread_id, start_ns, user_event_id
