-- kind: inline
-- description: The tracks of threads, and of what their executors did on them.
-- grain: one row per thread
SELECT
    t.thread_id * 8 + 2 AS track,
    p.track AS parent, p.pid,
    CASE WHEN count(*) OVER (PARTITION BY t.tid) = 1 THEN t.tid
        ELSE 1500000000 + row_number() OVER (ORDER BY t.thread_id) END AS tid,
    printf('%s %d', coalesce(t.name, '?'), t.tid) AS name,
    t.thread_id IN (SELECT thread_id FROM main.executor_state WHERE run_id = $run_id) AS has_states,
    t.thread_id * 8 + 3 AS state_track
FROM main.thread AS t
JOIN perfetto_process AS p ON t.process_id * 8 + 1 = p.track
WHERE t.run_id = $run_id
ORDER BY track
