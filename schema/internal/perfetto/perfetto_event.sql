-- title: Events of the user in Perfetto
-- description: Events of the user's own tracepoints, as moments on their threads.
-- grain: one row per event
-- column: track BIGINT  Track of its thread
-- column: at_ns BIGINT [epoch ns]  When
-- column: name VARCHAR  Provider and event
-- column: id BIGINT  Identity of the event
-- column: fields VARCHAR  Its fields, as JSON
SELECT thread_id * 8 + 2 AS track, at_ns, name, user_event_id AS id, fields
FROM main.user_event
WHERE run_id = $run_id AND at_ns >= $start_ns AND at_ns < $end_ns
ORDER BY track, at_ns, id
