-- description: For how long the thread of a callback instance waited for a CPU before it, outside
--     of other callbacks, and what had the CPU meanwhile: as a kernel trace shows it.
-- grain: one row per waiting callback instance whose thread the kernel traced
-- param: waits VARCHAR  Name of rows as of derive.callback_ready
CREATE OR REPLACE MACRO derive.executor_queue(waits) AS TABLE
WITH waiting AS MATERIALIZED (
    SELECT
        callback_instance_id, thread_id,
        coalesce(earliest_ns, latest_ns) AS from_ns,
        start_ns
    FROM query_table(waits)
    WHERE coalesce(earliest_ns, latest_ns) IS NOT NULL
        AND thread_id IN (SELECT thread_id FROM store.thread_state)
),
-- What begins and ends a callback needs a CPU: such a state lies inside of a callback, or outside.
outside AS MATERIALIZED (
    SELECT
        s.thread_id, s.state, s.start_ns, s.end_ns,
        row_number() OVER (PARTITION BY s.thread_id ORDER BY s.start_ns) AS number
    FROM store.thread_state AS s
    ASOF LEFT JOIN (
        SELECT thread_id, start_ns, end_ns FROM store.callback_instance WHERE parent_id IS NULL
    ) AS i
        ON s.thread_id = i.thread_id AND s.start_ns >= i.start_ns
    WHERE s.state IN ('preempted', 'runnable')
        AND s.thread_id IN (SELECT thread_id FROM waiting)
        AND coalesce(i.end_ns <= s.start_ns, true)
),
-- These follow each other on a thread, so those that overlap a wait are neighbours.
pair AS MATERIALIZED (
    SELECT
        w.*,
        unnest(range(coalesce(f.number, 1), l.number + 1)) AS number
    FROM waiting AS w
    ASOF JOIN outside AS l ON w.thread_id = l.thread_id AND w.start_ns > l.start_ns
    ASOF LEFT JOIN outside AS f ON w.thread_id = f.thread_id AND w.from_ns >= f.start_ns
    WHERE l.end_ns > w.from_ns
),
queued AS (
    SELECT
        p.callback_instance_id, o.state,
        least(o.end_ns, p.start_ns) - greatest(o.start_ns, p.from_ns) AS length_ns
    FROM pair AS p
    JOIN outside AS o ON p.thread_id = o.thread_id AND p.number = o.number
    WHERE o.end_ns > p.from_ns
),
summed AS (
    SELECT
        callback_instance_id,
        sum(length_ns) FILTER (WHERE state = 'runnable') AS run_queue_ns,
        sum(length_ns) FILTER (WHERE state = 'preempted') AS preempted_ns
    FROM queued
    GROUP BY callback_instance_id
),
preemptor AS (
    SELECT
        o.thread_id, o.number, p.start_ns, p.end_ns,
        p.preemptor_thread_id IS NULL AND p.preemptor_other_thread_id IS NULL AS is_idle,
        CASE WHEN is_idle THEN 'idle CPU' ELSE coalesce(t.name, x.program) END AS name
    FROM store.preemptor AS p
    ASOF JOIN outside AS o ON p.thread_id = o.thread_id AND p.start_ns >= o.start_ns
    LEFT JOIN store.thread AS t ON p.preemptor_thread_id = t.thread_id
    LEFT JOIN store.other_thread AS x ON p.preemptor_other_thread_id = x.other_thread_id
    -- A CPU that is idle for less begins to run the thread (main.withheld_cpu).
    WHERE p.start_ns < o.end_ns
        AND (NOT is_idle OR p.end_ns - p.start_ns >= 1_000_000)
),
named AS (
    SELECT
        w.callback_instance_id, p.name,
        sum(least(p.end_ns, w.start_ns) - greatest(p.start_ns, w.from_ns))::BIGINT AS length_ns
    FROM pair AS w
    JOIN preemptor AS p ON w.thread_id = p.thread_id AND w.number = p.number
    WHERE p.end_ns > w.from_ns AND p.start_ns < w.start_ns
    GROUP BY w.callback_instance_id, p.name
),
taken AS (
    SELECT
        callback_instance_id,
        list(name ORDER BY length_ns DESC, name) AS cpu_taken_by,
        list(length_ns ORDER BY length_ns DESC, name) AS cpu_taken_ns
    FROM named
    GROUP BY callback_instance_id
)
SELECT
    w.callback_instance_id,
    coalesce(s.run_queue_ns, 0)::BIGINT AS run_queue_ns,
    coalesce(s.preempted_ns, 0)::BIGINT AS preempted_ns,
    t.cpu_taken_by, t.cpu_taken_ns
FROM waiting AS w
LEFT JOIN summed AS s ON w.callback_instance_id = s.callback_instance_id
LEFT JOIN taken AS t ON w.callback_instance_id = t.callback_instance_id
