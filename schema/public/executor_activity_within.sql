-- description: The rows of main.executor_activity that reach into a time window, far sooner than
--     selected from all. What began before, and has no end since a gap follows, is among them only
--     if the gap ends in the window or later.
-- grain: one row per interval of a thread in which nothing changed
-- param: runs BIGINT[]  Runs to look at; NULL: all
-- param: window_start_ns BIGINT  Begin of the window, epoch ns; NULL: from the first event
-- param: window_end_ns BIGINT  End of the window, epoch ns, exclusive; NULL: to the last event
-- column: run_id, executor_id, thread_id
-- column: activity VARCHAR  'wait', 'select', 'take', 'callback', 'service' or 'blocked'
-- column: start_ns
-- column: end_ns BIGINT [epoch ns]  End; NULL: not known (the last, or a gap follows)
-- column: callback_instance_id BIGINT  Innermost callback that ran
CREATE OR REPLACE MACRO main.executor_activity_within(runs, window_start_ns, window_end_ns) AS TABLE
WITH activity AS (
    SELECT
        a.run_id, a.executor_id, a.thread_id, a.activity,
        derive.corrected_ns(a.start_ns, p) AS start_ns,
        derive.corrected_ns(a.end_ns, p) AS end_ns,
        a.callback_instance_id
    FROM derive.thread_activity(runs, window_start_ns, window_end_ns) AS a
    JOIN store.thread AS t ON a.thread_id = t.thread_id
    JOIN derive.process_clock AS p ON t.process_id = p.process_id
)
FROM activity
WHERE coalesce(end_ns > window_start_ns, true) AND coalesce(start_ns < window_end_ns, true)
