-- description: Threads of processes.
-- grain: one row per thread
SELECT
    t.thread_id, t.process_id, p.pid, t.tid,
    printf('%s %d', coalesce(t.name, '?'), t.tid) AS name
FROM main.thread AS t
JOIN main.process AS p ON t.process_id = p.process_id
WHERE t.run_id = $run_id
ORDER BY t.thread_id
