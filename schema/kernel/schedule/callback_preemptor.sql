-- description: What ran on the CPU for which callback instances waited.
-- grain: one row per callback instance, and thread that ran meanwhile, with its priority, or none
--     while the CPU was idle
-- when: staging.preemptor
WITH overlap AS (
    SELECT
        c.callback_instance_id, p.preemptor_thread_id, p.preemptor_other_thread_id,
        p.preemptor_priority, p.state,
        least(c.end_ns, p.end_ns) - greatest(c.start_ns, p.start_ns) AS length_ns
    FROM staging.callback_state AS c
    JOIN staging.thread_state AS s ON c.state_number = s.number
    JOIN staging.preemptor AS p
        ON s.thread_id = p.thread_id AND s.start_ns
        = CASE s.state WHEN 'preempted' THEN p.wait_start_ns ELSE p.state_start_ns END
        AND s.state = p.state
    WHERE p.end_ns > c.start_ns AND p.start_ns < c.end_ns
)
SELECT
    callback_instance_id, preemptor_thread_id, preemptor_other_thread_id, preemptor_priority,
    coalesce(sum(length_ns) FILTER (WHERE state = 'preempted'), 0)::BIGINT AS preempted_ns,
    coalesce(sum(length_ns) FILTER (WHERE state = 'runnable'), 0)::BIGINT AS runnable_ns
FROM overlap
GROUP BY ALL
ORDER BY callback_instance_id, preempted_ns + runnable_ns DESC
