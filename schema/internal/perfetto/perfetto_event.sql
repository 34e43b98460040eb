-- description: Events of the user's own tracepoints, as moments on their threads.
-- grain: one row per event
SELECT thread_id * 8 + 2 AS track, at_ns, name, user_event_id AS id, fields
FROM main.user_event
WHERE run_id = $run_id AND at_ns >= $start_ns AND at_ns < $end_ns
ORDER BY track, at_ns, id
