-- description: Stretches of a millisecond or more in which the kernel kept a ready thread from a
--     CPU that nothing more urgent had: mostly the CPU was idle. A CPU that has something to run
--     leaves its idle state within less than that. A quota ends each of them when its period does,
--     and periods are multiples of 10 ms; it does not hold for real-time priorities, whose limit
--     lets threads with normal priority run, or none.
-- grain: one row per wait of a thread for a CPU, and such stretch of it
-- column: run_id, thread_id, start_ns, end_ns
-- column: state VARCHAR  State of the thread: 'preempted' or 'runnable'
-- column: cpu INTEGER  The CPU
-- column: priority
-- column: reason VARCHAR  What the numbers fit: 'quota' (the CPU time of its cgroup was used up),
--     'real_time_limit' (that of real-time threads), 'unused_cpu' (the CPU ran nothing from then
--     on, as one that is offline or isolated). NULL: none of these
WITH used AS (
    SELECT
        run_id, host_id, cpu,
        max(start_ns) AS last_ns,
        max(max(start_ns)) OVER (PARTITION BY run_id, host_id) AS end_ns
    FROM main.cpu_usage
    WHERE tid <> 0
    GROUP BY run_id, host_id, cpu
),
withheld AS (
    SELECT
        p.run_id, p.thread_id, p.start_ns, p.end_ns, p.state, p.cpu,
        p.thread_priority AS priority,
        p.is_cpu_idle AND s.cpu IS DISTINCT FROM p.cpu
            AND u.last_ns <= p.start_ns AND u.end_ns > p.start_ns AS is_unused,
        CASE WHEN s.start_ns = p.end_ns THEN p.end_ns END AS over_ns
    FROM main.preemptor AS p
    JOIN main.thread AS t ON p.thread_id = t.thread_id
    JOIN main.process AS o ON t.process_id = o.process_id
    LEFT JOIN used AS u ON p.run_id = u.run_id AND o.host_id = u.host_id AND p.cpu = u.cpu
    ASOF LEFT JOIN (
        SELECT thread_id, start_ns, cpu FROM main.thread_state WHERE state = 'running'
    ) AS s
        ON p.thread_id = s.thread_id AND p.end_ns <= s.start_ns
    WHERE p.end_ns - p.start_ns >= 1_000_000
        AND (
            p.is_cpu_idle
            OR (p.state = 'preempted' AND p.thread_priority < 100 AND p.preemptor_priority >= 100)
        )
),
step AS (
    SELECT
        *,
        -- Half a millisecond beside a multiple of 10 ms, at most.
        abs(
            (over_ns - lag(over_ns IGNORE NULLS) OVER (PARTITION BY thread_id ORDER BY end_ns))
            % 10_000_000 - 5_000_000
        ) >= 4_500_000 AS is_regular
    FROM withheld
)
SELECT
    run_id, thread_id, start_ns, end_ns, state, cpu, priority,
    CASE
        WHEN is_unused THEN 'unused_cpu'
        -- A thread that runs does not leave an idle CPU otherwise. One that is only woken late may
        -- have a machine that does not run.
        WHEN NOT bool_or(state = 'preempted') OVER thread THEN NULL
        WHEN priority < 100 THEN 'real_time_limit'
        WHEN count(is_regular) OVER thread > 1 AND avg(is_regular::INTEGER) OVER thread >= 0.8
            THEN 'quota'
    END AS reason
FROM step
WINDOW thread AS (PARTITION BY thread_id)
