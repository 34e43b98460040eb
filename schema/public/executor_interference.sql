-- name: main.executor_interference
-- description: What the threads of its executor ran while a callback instance waited. Overlaps on
--     one thread add up to the time for which it was busy; overlaps on several threads may lie side
--     by side in time.
-- grain: one row per waiting callback instance and one that its executor was busy with meanwhile
-- column: run_id BIGINT  Run that the row belongs to
-- column: callback_instance_id BIGINT  Callback instance that waited
-- column: meanwhile_id BIGINT  Callback instance that the executor was busy with
-- column: meanwhile_callback_id BIGINT  Its callback
-- column: executor_id BIGINT  Their executor
-- column: thread_id BIGINT  Thread that was busy
-- column: overlap_ns BIGINT [ns]  Overlap from earliest_ns of the wait on (from latest_ns if that
--     is unknown)
-- column: certain_ns BIGINT [ns]  Overlap from latest_ns of the wait on
-- needs: derive.callback_ready, derive.executor_run, store.executor_thread
WITH ready AS (
    SELECT
        r.run_id,
        r.executor_id,
        r.callback_instance_id,
        coalesce(r.earliest_ns, r.latest_ns) AS from_ns,
        r.latest_ns,
        r.start_ns,
        x.thread_id
    FROM derive.callback_ready AS r
    JOIN store.executor_thread AS x ON r.executor_id = x.executor_id
    WHERE r.start_ns > coalesce(r.earliest_ns, r.latest_ns)
),
run AS (
    SELECT thread_id, callback_instance_id, callback_id, start_ns, end_ns, position
    FROM derive.executor_run
    WHERE end_ns > start_ns
),
-- As derive.executor_meanwhile of all instances; but DuckDB 1.4 finds no CTE of a macro that a view
-- of a newer file calls.
bounded AS (
    SELECT
        w.run_id, w.executor_id, w.callback_instance_id, w.from_ns, w.latest_ns, w.start_ns,
        w.thread_id, l.position AS last_position,
        CASE WHEN f.end_ns > w.from_ns THEN f.position ELSE coalesce(f.position, 0) + 1 END
            AS first_position
    FROM ready AS w
    ASOF JOIN run AS l ON w.thread_id = l.thread_id AND w.start_ns > l.start_ns
    ASOF LEFT JOIN run AS f ON w.thread_id = f.thread_id AND w.from_ns >= f.start_ns
),
pair AS (
    SELECT
        run_id, executor_id, callback_instance_id, from_ns, latest_ns, start_ns, thread_id,
        unnest(range(first_position, last_position + 1)) AS position
    FROM bounded
    WHERE first_position <= last_position
)
SELECT
    p.run_id,
    p.callback_instance_id,
    r.callback_instance_id AS meanwhile_id,
    r.callback_id AS meanwhile_callback_id,
    p.executor_id,
    p.thread_id,
    least(r.end_ns, p.start_ns) - greatest(r.start_ns, p.from_ns) AS overlap_ns,
    greatest(least(r.end_ns, p.start_ns) - greatest(r.start_ns, p.latest_ns), 0) AS certain_ns
FROM pair AS p
JOIN run AS r ON p.thread_id = r.thread_id AND p.position = r.position
