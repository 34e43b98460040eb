-- description: What bars of thread_bar.sql call by number. Without kernel traces there are none.
-- grain: one row per thread with known states, and per other thread; one for an idle CPU
-- column: id BIGINT  Twice the thread_id; of a thread of another process one more than twice its
--     other_thread_id; -2: nothing, the CPU is idle
-- column: name VARCHAR  Its name, and its number; of a ROS process its nodes stand first
SELECT
    2 * t.thread_id AS id,
    printf('%s %d', l.label, t.tid) AS name
FROM main.thread AS t
JOIN main.thread_label AS l ON t.thread_id = l.thread_id
WHERE t.run_id = $run AND t.thread_id IN (SELECT thread_id FROM main.thread_state)
UNION ALL
SELECT
    2 * other_thread_id + 1,
    printf('%s %d', coalesce(name, '?'), tid)
FROM main.other_thread
WHERE run_id = $run
UNION ALL
SELECT -2, 'idle CPU'
WHERE EXISTS (FROM main.thread_state WHERE run_id = $run AND is_cpu_idle)
ORDER BY id
