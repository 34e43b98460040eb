-- description: The moments at which executors learned what is ready: the ends of their waits
--     (polling points). What is not found there waits for the next one. `before_ns` is the sum of
--     all time spent waiting before. A wait of less than a millisecond may have found something
--     ready at once. When a longer one began, nothing was ready: `asleep_ns` is the begin of the
--     latest such wait. Waits inside a callback that spins are left out: its executor does not
--     learn from them.
-- grain: one row per wait of an executor that was seen to end
-- param: executors VARCHAR  Name of rows with the executors to look at (executor_id) and moments
--     (until_ns). Waits that began after the latest of these moments are left out, unless all
--     are NULL
CREATE OR REPLACE MACRO derive.executor_poll(executors) AS TABLE
WITH interval AS MATERIALIZED (
    SELECT run_id, executor_id, thread_id, state, start_ns, end_ns, callback_instance_id
    FROM derive.executor_interval
    WHERE end_ns IS NOT NULL
        AND (state = 'wait' OR callback_instance_id IS NOT NULL)
        -- By thread, not by executor: DuckDB leaves other threads out before it orders the rows.
        AND thread_id IN (
            SELECT thread_id
            FROM store.executor_thread
            WHERE executor_id IN (SELECT executor_id FROM query_table(executors))
        )
),
wait AS (
    SELECT run_id, executor_id, thread_id, start_ns, end_ns
    FROM interval
    WHERE state = 'wait'
        AND start_ns <= (
            SELECT coalesce(max(until_ns), 9223372036854775807) FROM query_table(executors)
        )
),
-- Threads with a callback that may spin: the next event of the executor came before its end, and
-- the thread began a wait after it had begun.
spinning AS (
    SELECT DISTINCT i.thread_id
    FROM store.callback_instance AS i
    JOIN (SELECT thread_id, max(start_ns) AS start_ns FROM wait GROUP BY thread_id) AS w
        ON i.thread_id = w.thread_id AND i.start_ns <= w.start_ns
    ANTI JOIN interval AS s
        ON i.callback_instance_id = s.callback_instance_id AND i.end_ns <= s.end_ns
    WHERE i.depth = 1 AND i.end_ns > i.start_ns
),
own AS (
    SELECT w.run_id, w.executor_id, w.start_ns, w.end_ns
    FROM wait AS w
    ANTI JOIN spinning AS s ON w.thread_id = s.thread_id
    UNION ALL
    SELECT w.run_id, w.executor_id, w.start_ns, w.end_ns
    FROM (SELECT * FROM wait SEMI JOIN spinning USING (thread_id)) AS w
    ASOF LEFT JOIN (
        SELECT thread_id, start_ns, end_ns
        FROM derive.executor_run
        SEMI JOIN spinning USING (thread_id)
    ) AS r ON w.thread_id = r.thread_id AND w.start_ns >= r.start_ns
    WHERE r.end_ns IS NULL OR r.end_ns <= w.start_ns
)
SELECT
    run_id, executor_id, start_ns, end_ns,
    lag(end_ns) OVER in_time AS previous_end_ns,
    max(CASE WHEN end_ns - start_ns >= 1000000 THEN start_ns END) OVER (
        in_time ROWS UNBOUNDED PRECEDING
    ) AS asleep_ns,
    coalesce(sum(end_ns - start_ns) OVER (
        in_time ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    ), 0)::BIGINT AS before_ns
FROM own
WINDOW in_time AS (PARTITION BY run_id, executor_id ORDER BY end_ns)
