-- description: Samples of what threads ran, with their stacks.
-- grain: one row per sample of a thread that has a track
SELECT s.at_ns, t.pid, t.tid, coalesce(s.cpu, 0) AS cpu, s.stack_id
FROM main.stack_sample AS s
JOIN perfetto_thread AS t ON s.thread_id * 8 + 2 = t.track
WHERE s.run_id = $run_id AND s.at_ns >= $start_ns AND s.at_ns < $end_ns
ORDER BY s.at_ns, t.tid
