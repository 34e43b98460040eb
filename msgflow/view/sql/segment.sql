-- description: Bars of one run, as far as they overlap the window, and the pauses of events
--     executors in it.
-- grain: one row per bar
-- kind: inline
-- column: row_key BIGINT  Row of the timeline, see row.sql
-- column: kind UTINYINT  As in bar.sql
-- column: id BIGINT  Identity of the thing within its kind
-- column: start_ns
-- column: end_ns BIGINT [epoch ns]  End; the begin where the end was not seen
-- column: flags
SELECT row_key, kind, id, start_ns, end_ns, flags
FROM bar
WHERE run_id = $run AND start_ns < $end_ns AND end_ns >= $start_ns
UNION ALL
SELECT
    8 * thread_id + 6,
    CASE activity WHEN 'wait' THEN 5 ELSE 6 END,
    -1, start_ns, end_ns, 0
FROM main.executor_pause([$run], $start_ns, $end_ns)
