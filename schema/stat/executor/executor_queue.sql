-- description: For how long the thread of a callback instance waited for a CPU before it, outside
--     of other callbacks, and what had the CPU meanwhile: as a kernel trace shows it.
-- grain: one row per waiting callback instance whose thread the kernel traced
-- param: waits VARCHAR  Name of rows as of derive.callback_ready
CREATE OR REPLACE MACRO derive.executor_queue(waits) AS TABLE
WITH waiting AS MATERIALIZED (
    SELECT callback_instance_id, thread_id, coalesce(earliest_ns, latest_ns) AS from_ns, start_ns
    FROM query_table(waits)
    WHERE coalesce(earliest_ns, latest_ns) IS NOT NULL
        AND thread_id IN (SELECT thread_id FROM store.thread_state)
),
stretch AS (
    SELECT
        false AS is_taken, thread_id, start_ns, end_ns, state,
        NULL::BIGINT AS preemptor_thread_id, NULL::BIGINT AS preemptor_other_thread_id
    FROM store.thread_state
    WHERE state IN ('preempted', 'runnable')
    UNION ALL
    SELECT true, thread_id, start_ns, end_ns, state, preemptor_thread_id, preemptor_other_thread_id
    FROM store.preemptor
),
-- What begins and ends a callback needs a CPU: such a wait lies inside of a callback, or outside.
outside AS MATERIALIZED (
    SELECT
        s.*,
        row_number() OVER (PARTITION BY s.is_taken, s.thread_id ORDER BY s.start_ns) AS number
    FROM stretch AS s
    ASOF LEFT JOIN (
        SELECT thread_id, start_ns, end_ns FROM store.callback_instance WHERE parent_id IS NULL
    ) AS i
        ON s.thread_id = i.thread_id AND s.start_ns >= i.start_ns
    WHERE s.thread_id IN (SELECT thread_id FROM waiting) AND coalesce(i.end_ns <= s.start_ns, true)
),
-- These follow each other on a thread, so those that overlap a wait are neighbours.
reached AS (
    SELECT
        w.callback_instance_id, w.thread_id, w.from_ns, w.start_ns, l.is_taken,
        l.number AS last_number
    FROM (SELECT w.*, unnest([true, false]) AS is_taken FROM waiting AS w) AS w
    ASOF JOIN outside AS l
        ON w.is_taken = l.is_taken AND w.thread_id = l.thread_id AND w.start_ns > l.start_ns
    WHERE l.end_ns > w.from_ns
),
pair AS (
    SELECT
        r.callback_instance_id, r.thread_id, r.from_ns, r.start_ns, r.is_taken,
        unnest(range(coalesce(f.number, 1), r.last_number + 1)) AS number
    FROM reached AS r
    ASOF LEFT JOIN outside AS f
        ON r.is_taken = f.is_taken AND r.thread_id = f.thread_id AND r.from_ns >= f.start_ns
),
overlap AS (
    SELECT
        p.callback_instance_id, o.is_taken, o.state, o.preemptor_thread_id,
        o.preemptor_other_thread_id,
        sum(least(o.end_ns, p.start_ns) - greatest(o.start_ns, p.from_ns))::BIGINT AS length_ns
    FROM pair AS p
    JOIN outside AS o
        ON p.is_taken = o.is_taken AND p.thread_id = o.thread_id AND p.number = o.number
    WHERE o.end_ns > p.from_ns
    GROUP BY ALL
),
named AS (
    SELECT
        o.callback_instance_id, coalesce(t.name, x.name) AS name,
        sum(o.length_ns)::BIGINT AS length_ns
    FROM overlap AS o
    LEFT JOIN store.thread AS t ON o.preemptor_thread_id = t.thread_id
    LEFT JOIN store.other_thread AS x ON o.preemptor_other_thread_id = x.other_thread_id
    -- An idle CPU is not taken.
    WHERE o.is_taken AND coalesce(x.tid <> 0, true)
    GROUP BY ALL
),
taken AS (
    SELECT
        callback_instance_id,
        list(name ORDER BY length_ns DESC, name) AS cpu_taken_by,
        list(length_ns ORDER BY length_ns DESC, name) AS cpu_taken_ns
    FROM named
    GROUP BY callback_instance_id
),
queued AS (
    SELECT
        callback_instance_id,
        sum(length_ns) FILTER (WHERE state = 'runnable') AS run_queue_ns,
        sum(length_ns) FILTER (WHERE state = 'preempted') AS preempted_ns
    FROM overlap
    WHERE NOT is_taken
    GROUP BY callback_instance_id
)
SELECT
    w.callback_instance_id,
    coalesce(q.run_queue_ns, 0)::BIGINT AS run_queue_ns,
    coalesce(q.preempted_ns, 0)::BIGINT AS preempted_ns,
    t.cpu_taken_by, t.cpu_taken_ns
FROM waiting AS w
LEFT JOIN queued AS q ON w.callback_instance_id = q.callback_instance_id
LEFT JOIN taken AS t ON w.callback_instance_id = t.callback_instance_id
