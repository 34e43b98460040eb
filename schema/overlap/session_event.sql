-- kind: inline
-- description: Events of the sessions that recorded at the same time as another one, with their
--     thread as the ids say: `thread` is the same number in all sessions. `thread_event` has the
--     events of all threads.
-- grain: one row per such event
WITH thread AS (
    SELECT
        r.thread_index,
        min(r.thread_index) OVER (
            PARTITION BY s.host, coalesce(r.pid_ns, n.pid_ns), r.vpid, r.vtid
        ) AS thread
    FROM raw.thread AS r
    JOIN session_trace AS s ON r.trace_index = s.trace_index
    LEFT JOIN process_namespace AS n ON s.host = n.host AND r.vpid = n.vpid
)
SELECT e.event_id, e.tracepoint, e.ts_ns, e.cpu_id, e.trace_index, s.session, t.thread
FROM thread_event AS e
JOIN session_trace AS s ON e.trace_index = s.trace_index
JOIN thread AS t ON e.thread_index = t.thread_index
WHERE s.session IN (SELECT left_session FROM overlap_window)
