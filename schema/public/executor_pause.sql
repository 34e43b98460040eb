-- description: What threads of events executors did between callbacks in a time window, as far as
--     that is known: these rows of main.executor_activity, far sooner.
-- grain: one row per interval of such a thread outside of callbacks and takes
-- param: runs BIGINT[]  Runs to look at; NULL: all
-- param: window_start_ns BIGINT  Begin of the window, epoch ns; NULL: from the first event
-- param: window_end_ns BIGINT  End of the window, epoch ns, exclusive; NULL: to the last event
-- column: run_id, thread_id
-- column: activity VARCHAR  'wait' or 'select'
-- column: start_ns, end_ns
CREATE OR REPLACE MACRO main.executor_pause(runs, window_start_ns, window_end_ns) AS TABLE
WITH pause AS (
    SELECT
        q.run_id, q.thread_id, q.activity,
        derive.corrected_ns(q.start_ns, c) AS start_ns,
        derive.corrected_ns(q.end_ns, c) AS end_ns
    FROM derive.queue_activity(runs) AS q
    JOIN store.thread AS t ON q.thread_id = t.thread_id
    JOIN derive.process_clock AS c ON t.process_id = c.process_id
)
FROM pause
WHERE coalesce(end_ns > window_start_ns, true) AND coalesce(start_ns < window_end_ns, true)
