-- description: What the threads of its executor ran while a callback instance waited. The messages
--     of a burst wait for each other: the pairs of all instances are many, those of one instance
--     are few.
-- grain: one row per waiting callback instance and one that its executor was busy with meanwhile
-- param: waits VARCHAR  Name of rows as of derive.callback_ready
CREATE OR REPLACE MACRO derive.executor_meanwhile(waits) AS TABLE
WITH waiting AS (
    SELECT
        r.run_id, r.executor_id, r.callback_instance_id,
        coalesce(r.earliest_ns, r.latest_ns) AS from_ns,
        r.latest_ns, r.start_ns, x.thread_id
    FROM query_table(waits) AS r
    JOIN store.executor_thread AS x ON r.executor_id = x.executor_id
    WHERE r.start_ns > coalesce(r.earliest_ns, r.latest_ns)
),
run AS (
    SELECT thread_id, callback_instance_id, callback_id, start_ns, end_ns, position
    FROM derive.executor_run
    WHERE end_ns > start_ns
),
-- What a thread runs is in order, so the instances that overlap a wait are neighbours: from the one
-- that was under way when the wait began, or the one before it, to the last that began before its
-- end. As a rule, no instance does where the last one was over when the wait began.
pair AS (
    SELECT
        w.*,
        unnest(range(coalesce(f.position, 1), l.position + 1)) AS position
    FROM waiting AS w
    ASOF JOIN run AS l ON w.thread_id = l.thread_id AND w.start_ns > l.start_ns
    ASOF LEFT JOIN run AS f ON w.thread_id = f.thread_id AND w.from_ns >= f.start_ns
    WHERE l.end_ns > w.from_ns
)
SELECT
    p.run_id, p.callback_instance_id,
    r.callback_instance_id AS meanwhile_id,
    r.callback_id AS meanwhile_callback_id,
    p.executor_id, p.thread_id,
    least(r.end_ns, p.start_ns) - greatest(r.start_ns, p.from_ns) AS overlap_ns,
    greatest(least(r.end_ns, p.start_ns) - greatest(r.start_ns, p.latest_ns), 0) AS certain_ns
FROM pair AS p
JOIN run AS r ON p.thread_id = r.thread_id AND p.position = r.position
WHERE r.end_ns > p.from_ns
