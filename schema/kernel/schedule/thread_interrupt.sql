-- name: staging.thread_interrupt
-- description: Interrupts that were handled while a thread of a ROS process had the CPU. Those of
--     timers are left out.
-- grain: one row per interrupt
-- when: raw.interrupt
SELECT
    r.number AS state_number, i.kind::VARCHAR AS kind, i.start_ns + s.shift_ns AS start_ns,
    i.end_ns + s.shift_ns AS end_ns
FROM raw.interrupt AS i
JOIN staging.schedule AS s ON i.trace_index = s.trace_index
JOIN staging.thread_tid AS t
    ON s.clock_key = t.clock_key
    AND i.tid = t.tid
    AND i.start_ns + s.shift_ns >= t.from_ns
    AND i.start_ns + s.shift_ns < t.until_ns
ASOF JOIN (SELECT * FROM staging.thread_state WHERE state = 'running') AS r
    ON t.thread_id = r.thread_id AND i.start_ns + s.shift_ns >= r.start_ns
WHERE s.is_joined AND i.kind <> 'timer'
