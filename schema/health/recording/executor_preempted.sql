-- title: Other threads take the CPU from an executor
-- description: Callbacks of an executor with normal priority had work to do, but another thread had
--     the CPU for more than a tenth of that time. They take that much longer than they compute.
--     Below a tenth other reasons of latency weigh more, as a rule.
-- cause: The machine has more to do than its CPUs can, and to the kernel the executor is a thread
--     like any other one.
-- cure: Give the executor a real-time priority (chrt --fifo), or a CPU of its own (taskset,
--     cpusets); make what takes the CPU nicer (nice, cgroups) or move it away. msgflow query
--     scheduling --measure preemption says what that is. Of an idle CPU cpu_quota and
--     real_time_limit tell.
-- grain: one row per thread of an executor
-- severity: warning
-- when: store.thread_state
WITH spent AS (
    SELECT
        i.run_id, i.thread_id,
        sum(s.running_ns) AS running_ns
    FROM main.callback_schedule AS s
    JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
    -- A nested one is in the time of the outer one.
    WHERE i.parent_id IS NULL
    GROUP BY i.run_id, i.thread_id
),
lost AS (
    SELECT
        p.callback_instance_id, i.thread_id, p.preempted_ns,
        coalesce(b.name, o.program, '?') AS name
    FROM main.callback_preemptor AS p
    JOIN main.callback_instance AS i ON p.callback_instance_id = i.callback_instance_id
    LEFT JOIN main.thread AS b ON p.preemptor_thread_id = b.thread_id
    LEFT JOIN main.other_thread AS o ON p.preemptor_other_thread_id = o.other_thread_id
    WHERE p.preempted_ns > 0
        AND NOT p.is_cpu_idle
        AND NOT coalesce(o.is_recorder, false)
        AND i.parent_id IS NULL
),
total AS (
    SELECT
        thread_id,
        count(DISTINCT callback_instance_id) AS number,
        sum(preempted_ns) AS preempted_ns
    FROM lost
    GROUP BY thread_id
),
first AS (
    SELECT
        thread_id,
        arg_max(name, (length_ns, name)) AS name
    FROM (
        SELECT
            thread_id, name,
            sum(preempted_ns) AS length_ns
        FROM lost
        GROUP BY thread_id, name
    )
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
    t.number AS count,
    printf(
        'another thread had the CPU for %.3f s of %.3f s in which callbacks had work to do '
        || '(%.0f %%), most of it %s',
        t.preempted_ns / 1e9, (s.running_ns + t.preempted_ns) / 1e9,
        100 * t.preempted_ns / (s.running_ns + t.preempted_ns), f.name
    ) AS detail
FROM spent AS s
JOIN priority AS k ON s.thread_id = k.thread_id
JOIN total AS t ON s.thread_id = t.thread_id
JOIN first AS f ON s.thread_id = f.thread_id
WHERE 10 * t.preempted_ns > s.running_ns + t.preempted_ns
    -- Below 100 the kernel's priorities are real-time.
    AND k.priority >= 100
    AND s.thread_id IN (SELECT thread_id FROM main.executor_thread)
