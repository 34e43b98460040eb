-- name: overlap.duplicate_event
-- kind: inline
-- description: Events to leave out because another session recorded them as well. Of the sessions
--     that recorded a tracepoint on a thread, the one with most events of the thread counts; the
--     others keep what lies outside of its time. `thread_event` has the events of all threads.
-- grain: one row per event that is left out
WITH thread AS (
    SELECT
        r.thread_index,
        min(r.thread_index) OVER (
            PARTITION BY s.host, coalesce(r.pid_ns, n.pid_ns), r.vpid, r.vtid
        ) AS thread
    FROM raw.thread AS r
    JOIN session_trace AS s ON r.trace_index = s.trace_index
    LEFT JOIN process_namespace AS n ON s.host = n.host AND r.vpid = n.vpid
),
placed AS (
    SELECT e.event_id, e.tracepoint, e.ts_ns, e.cpu_id, e.trace_index, s.session, t.thread
    FROM thread_event AS e
    JOIN session_trace AS s ON e.trace_index = s.trace_index
    JOIN thread AS t ON e.thread_index = t.thread_index
    WHERE s.session IN (SELECT left_session FROM overlap_window)
),
recorded AS (
    SELECT
        thread, tracepoint, session,
        sum(count(*)) OVER (PARTITION BY thread, session) AS event_count,
        min(min(trace_index)) OVER (PARTITION BY session) AS first_index
    FROM placed
    GROUP BY thread, tracepoint, session
),
preferred AS (
    SELECT
        l.thread, l.tracepoint, l.session AS left_session, u.session AS used_session,
        u.first_index AS used_index
    FROM recorded AS l
    JOIN recorded AS u
        ON l.thread = u.thread
        AND l.tracepoint = u.tracepoint
        AND (-u.event_count, u.first_index) < (-l.event_count, l.first_index)
)
SELECT
    p.event_id,
    any_value(p.trace_index) AS trace_index,
    min(f.used_index) AS used_index,
    any_value(p.thread) AS thread,
    any_value(p.ts_ns) AS ts_ns
FROM placed AS p
JOIN preferred AS f
    ON p.thread = f.thread AND p.tracepoint = f.tracepoint AND p.session = f.left_session
JOIN overlap_window AS o
    ON f.left_session = o.left_session
    AND f.used_session = o.used_session
    AND p.cpu_id IS NOT DISTINCT FROM o.cpu_id
    AND p.ts_ns >= o.begin_ns
    AND p.ts_ns <= o.end_ns
GROUP BY p.event_id
