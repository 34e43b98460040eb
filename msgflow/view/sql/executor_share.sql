-- name: executor_share
-- title: What executor threads did over time
-- description: States of executor threads by pieces of time; of threads whose executor tells
--     nothing of itself, the time in callbacks.
-- grain: one row per thread, piece of time and state
-- param: run BIGINT  Run
-- param: origin_ns BIGINT  What times count from, epoch ns
-- param: start_ns BIGINT  Begin of the window, epoch ns
-- param: end_ns BIGINT  Its end, epoch ns, exclusive
-- param: bins BIGINT = 200  Number of pieces
-- column: thread_id BIGINT  The thread
-- column: start_at BIGINT [ns since origin]  Begin of the piece
-- column: length BIGINT [ns]  Length of the piece
-- column: state VARCHAR  'wait', 'process', 'execute', or 'callback'
-- column: busy BIGINT [ns]  Time of the piece in the state
WITH extent AS (
    SELECT ($end_ns - $start_ns) // $bins + 1 AS width
),
silent AS (
    SELECT DISTINCT thread_id FROM main.executor_thread WHERE run_id = $run
    EXCEPT
    SELECT DISTINCT thread_id FROM main.executor_state WHERE run_id = $run
),
did AS (
    SELECT thread_id, state, start_ns, end_ns
    FROM main.executor_state
    WHERE run_id = $run AND end_ns IS NOT NULL
    UNION ALL
    SELECT thread_id, 'callback', start_ns, end_ns
    FROM main.callback_instance
    WHERE run_id = $run AND end_ns IS NOT NULL AND parent_id IS NULL
        AND thread_id IN (SELECT thread_id FROM silent)
),
clipped AS (
    SELECT
        d.thread_id, d.state, e.width,
        greatest(d.start_ns, $start_ns) - $start_ns AS begin_at,
        least(d.end_ns, $end_ns) - $start_ns AS end_at
    FROM did AS d
    CROSS JOIN extent AS e
    WHERE d.start_ns < $end_ns AND d.end_ns > $start_ns
),
whole AS (
    SELECT thread_id, state, width, begin_at, end_at, begin_at // width AS bin
    FROM clipped
    WHERE begin_at // width = (end_at - 1) // width
    UNION ALL
    SELECT
        thread_id, state, width, begin_at, end_at,
        unnest(range(begin_at // width, (end_at - 1) // width + 1))
    FROM clipped
    WHERE begin_at // width <> (end_at - 1) // width
)
SELECT
    thread_id,
    $start_ns - $origin_ns + bin * width AS start_at,
    width AS length,
    state,
    sum(least(end_at, (bin + 1) * width) - greatest(begin_at, bin * width))::BIGINT AS busy
FROM whole
GROUP BY thread_id, bin, width, state
ORDER BY thread_id, start_at, state
