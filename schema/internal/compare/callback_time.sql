-- description: How the mean duration of callbacks differs between two runs, by what their threads
--     did. Only callbacks whose duration is known to differ, and that the kernel's trace of both
--     runs shows, the greatest difference first.
-- grain: one row per callback that two runs have
-- param: run_a, run_b
-- param: subjects VARCHAR[]  Callbacks, as main.comparison names them
-- param: skip_first, a_window, b_window
WITH mean AS (
    SELECT
        i.side,
        i.node || ' · ' || i.label AS subject,
        avg(i.end_ns - i.start_ns) AS duration_ns,
        avg(s.running_ns) AS running_ns,
        avg(s.preempted_ns + s.runnable_ns) AS queue_ns,
        avg(s.sleeping_ns + s.uninterruptible_ns) AS blocked_ns
    FROM compared_instance AS i
    JOIN main.callback_schedule AS s ON i.callback_instance_id = s.callback_instance_id
    WHERE list_contains($subjects, i.node || ' · ' || i.label)
    GROUP BY ALL
)
SELECT
    a.subject,
    round(b.duration_ns - a.duration_ns)::BIGINT AS duration_ns,
    round(b.running_ns - a.running_ns)::BIGINT AS running_ns,
    round(b.queue_ns - a.queue_ns)::BIGINT AS queue_ns,
    round(b.blocked_ns - a.blocked_ns)::BIGINT AS blocked_ns
FROM mean AS a
JOIN mean AS b ON a.subject = b.subject
WHERE a.side = 'a' AND b.side = 'b'
ORDER BY abs(b.duration_ns - a.duration_ns) DESC, a.subject
