-- description: Events to leave out because another session recorded them as well. Of the sessions
--     that recorded a tracepoint on a thread, the one with most events of the thread counts; the
--     others keep what lies outside of its time.
-- grain: one row per event that is left out
-- column: event_id BIGINT  The event
-- column: trace_index INTEGER  Trace that it is left out of
-- column: used_index INTEGER  Trace that has it as well
-- column: thread INTEGER  Its thread, as in session_event
-- column: ts_ns BIGINT [epoch ns]  Its time
-- when: temp.overlap_window
WITH recorded AS (
    SELECT
        thread, tracepoint, session,
        sum(count(*)) OVER (PARTITION BY thread, session) AS event_count,
        min(min(trace_index)) OVER (PARTITION BY session) AS first_index
    FROM session_event
    GROUP BY thread, tracepoint, session
),
preferred AS (
    SELECT
        l.thread, l.tracepoint,
        l.session AS left_session,
        u.session AS used_session,
        u.first_index AS used_index
    FROM recorded AS l
    JOIN recorded AS u
        ON l.thread = u.thread
        AND l.tracepoint = u.tracepoint
        AND (-u.event_count, u.first_index) < (-l.event_count, l.first_index)
    LEFT JOIN session_container AS lc ON l.session = lc.session
    LEFT JOIN session_container AS uc ON u.session = uc.session
    WHERE lc.container IS NOT DISTINCT FROM uc.container
)
SELECT
    p.event_id,
    any_value(p.trace_index) AS trace_index,
    min(f.used_index) AS used_index,
    any_value(p.thread) AS thread,
    any_value(p.ts_ns) AS ts_ns
FROM session_event AS p
JOIN preferred AS f
    ON p.thread = f.thread AND p.tracepoint = f.tracepoint AND p.session = f.left_session
JOIN overlap_window AS o
    ON f.left_session = o.left_session
    AND f.used_session = o.used_session
    AND p.cpu_id IS NOT DISTINCT FROM o.cpu_id
    AND p.ts_ns >= o.begin_ns
    AND p.ts_ns <= o.end_ns
GROUP BY p.event_id
