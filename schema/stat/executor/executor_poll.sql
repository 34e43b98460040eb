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
WITH wait AS (
    SELECT run_id, executor_id, thread_id, start_ns, end_ns
    FROM derive.executor_interval
    WHERE state = 'wait'
        AND end_ns IS NOT NULL
        -- By thread, not by executor: DuckDB leaves other threads out before it orders the rows.
        AND thread_id IN (
            SELECT thread_id
            FROM store.executor_thread
            WHERE executor_id IN (SELECT executor_id FROM query_table(executors))
        )
        AND start_ns <= (
            SELECT coalesce(max(until_ns), 9223372036854775807) FROM query_table(executors)
        )
),
own AS (
    SELECT w.run_id, w.executor_id, w.start_ns, w.end_ns
    FROM wait AS w
    ASOF LEFT JOIN derive.executor_run AS r
        ON w.thread_id = r.thread_id AND w.start_ns >= r.start_ns
    WHERE coalesce(r.end_ns <= w.start_ns, true)
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
