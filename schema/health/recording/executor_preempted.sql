-- title: Other threads take the CPU from an executor
-- description: Callbacks of an executor with normal priority had work to do, but another thread had
--     the CPU for more than a tenth of that time. They take that much longer than they compute.
--     Below a tenth other reasons of latency weigh more, as a rule.
-- cause: The machine has more to do than its CPUs can, and to the kernel the executor is a thread
--     like any other one.
-- cure: Give the executor a real-time priority (chrt --fifo), or a CPU of its own (taskset,
--     cpusets); make what takes the CPU nicer (nice, cgroups) or move it away. msgflow query
--     scheduling --measure preemption says what that is.
-- grain: one row per thread of an executor
-- severity: warning
-- when: store.thread_state
WITH spent AS (
    SELECT
        i.run_id, i.thread_id,
        count(*) FILTER (WHERE s.preempted_ns > 0) AS number,
        sum(s.running_ns) AS running_ns,
        sum(s.preempted_ns) AS preempted_ns
    FROM main.callback_schedule AS s
    JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
    -- A nested one is in the time of the outer one.
    WHERE i.parent_id IS NULL
    GROUP BY i.run_id, i.thread_id
),
taken AS (
    SELECT
        s.thread_id,
        coalesce(b.name, o.name, '?') AS name,
        sum(s.end_ns - s.start_ns) AS length_ns
    FROM main.thread_state AS s
    LEFT JOIN main.thread AS b ON s.preempted_by_thread_id = b.thread_id
    LEFT JOIN main.other_thread AS o ON s.preempted_by_other_thread_id = o.other_thread_id
    WHERE s.state = 'preempted'
    GROUP BY ALL
),
first AS (
    SELECT
        thread_id,
        arg_max(name, (length_ns, name)) AS name
    FROM taken
    GROUP BY thread_id
),
-- The least urgent one that it ran with.
priority AS (
    SELECT
        thread_id,
        max(priority) AS priority
    FROM main.thread_state
    WHERE state = 'running'
    GROUP BY thread_id
)
SELECT
    s.run_id, s.thread_id,
    s.number AS count,
    printf(
        'another thread had the CPU for %.3f s of %.3f s in which callbacks had work to do '
        || '(%.0f %%), most of it %s',
        s.preempted_ns / 1e9, (s.running_ns + s.preempted_ns) / 1e9,
        100 * s.preempted_ns / (s.running_ns + s.preempted_ns), f.name
    ) AS detail
FROM spent AS s
JOIN priority AS k ON s.thread_id = k.thread_id
JOIN first AS f ON s.thread_id = f.thread_id
WHERE 10 * s.preempted_ns > s.running_ns + s.preempted_ns
    -- Below 100 the kernel's priorities are real-time.
    AND k.priority >= 100
    AND s.thread_id IN (SELECT thread_id FROM main.executor_thread)
